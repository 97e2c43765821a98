# SPDX-License-Identifier: MIT
"""Access to the controller by SDO: reads its status, writes configuration, programs and commands. Used by all modules
that send to a controller or a drive.

`controller` is the entry point for the commands and the API.
"""
