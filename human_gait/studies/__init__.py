"""Studies: many walks by one file, from a laptop to a cluster.

A study file is read (`study_file`, `varied`); it makes points (`design`) and of each a walk with a
key and another one to start from (`plan`). A walk is found (`work`) and put into a folder
(`store`), in this process or by Dask (`engine`); an index of all is written (`index`) and read
(`opened`).
`calls` has what Python and the command begin with.
"""
