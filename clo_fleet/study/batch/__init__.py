"""Many runs: worlds x strategies x seeds x whatever is swept, each in a process of its own, their rows in tables.

Data flows one way: specification (`spec`) -> definitions of runs (`definition`) -> children (`launching`, `child`)
-> a folder for each run -> tables (`tables`). `running` puts them together on this machine, `cluster` on others.
"""
