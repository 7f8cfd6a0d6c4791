"""Many pieces of work side by side, missions above all: in processes of this machine, on a Dask cluster, or by any
`concurrent.futures.Executor`.
"""
