"""An attitude algorithm and a measurement for strapdown, added from outside."""
