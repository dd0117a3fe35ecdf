"""The aided navigator: segments between epochs, what it records, how it is watched."""
