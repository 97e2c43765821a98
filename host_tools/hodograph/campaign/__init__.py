# SPDX-License-Identifier: MIT
"""Campaigns: many simulated runs described by one file, with one row of a table for each. Used by cli/campaign_command
and schemas/campaign_file. Reads and writes files, and starts processes.

    definition  the campaign file, checked          programs   one image for each path, profile and feed
    variation   figures that differ from run to run  execute    a batch of runs, on whatever worker
    fault_rules faults that a run can have           engine     workers: this process, this machine, a cluster
    design      from a run's number to its settings  journal    what is done, so that a campaign can go on
    runner      all of it together                   table, summary, report  the results

A run's settings follow from its number and the campaign file alone, and its results from its settings (every step is
exact or of IEEE doubles in a fixed order), so neither workers nor interruptions change the table.
"""
