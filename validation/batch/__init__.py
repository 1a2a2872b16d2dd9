"""The batch job: campaign, work, executors, run file, result."""
