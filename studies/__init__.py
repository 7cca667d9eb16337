"""The gallery: each study is one problem with its study file, its figures and one asserted number."""

__distribution__ = "holdfast"
