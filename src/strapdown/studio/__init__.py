"""A local server that shows a folder of logs, runs the commands on them and shows the results."""
