"""The crash test of Tadic and Vukajlovic (2016)."""
