"""Pages, figures and files that a person reads, and the bundles that hold them."""
