"""A store that may be damaged: what is wrong with it, what can be saved, and rows of another joined to it.

examined(path): what is wrong, each check with what it did not look at.    recovered(study, folder): a new
store of the rows that are as they were stored.    merged(campaign, other): the answers of another campaign of
the same state of the model.
"""
