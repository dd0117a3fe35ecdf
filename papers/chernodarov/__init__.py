"""The statements and figures of Chernodarov (2009), one claim or figure a file."""
