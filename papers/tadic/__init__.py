"""The crash test of Tadic and Vukajlovic (2016), one file a figure or group of statements."""
