"""Run a navigation pipeline in real time: replayed records and live samples."""
