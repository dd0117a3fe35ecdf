"""Report pages, figures and data files, and the bundles that hold them."""
