"""The statements and figures of Chernodarov (2009)."""
