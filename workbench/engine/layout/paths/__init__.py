"""Convex layouts along the central path, with second derivatives or with what gradients tell of them."""
