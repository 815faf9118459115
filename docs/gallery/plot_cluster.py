"""
A matrix on a dask cluster
==========================

The blocks of a dissimilarity matrix can be computed by the workers of a dask cluster. Workers need the package and no
files: the process that asks for the matrix reads the parts and writes the blocks. The cluster here has two workers in
this process; for a real one, give ``Client`` the address of its scheduler.
"""

import tempfile
from pathlib import Path

from distributed import Client, LocalCluster

from curvematch_jax import build_matrix, creatures, extract_parts, load_matrix, matrix_status
from curvematch_jax.pictures import matrix_picture

models = list(creatures(["hand", "snake", "spider"], poses=2))
parts = [extract_parts(model.mesh) for model in models]

store = Path(tempfile.mkdtemp()) / "D.zarr"
workers = LocalCluster(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None)
with workers as cluster, Client(cluster) as client:
    build_matrix(parts, store, client=client, block=3)

status = matrix_status(store)
print(f"{status.done} blocks done, {status.left} left")

# %%
# The matrix can be read once it is complete. The same call would have resumed it after an interruption.

saved = load_matrix(store)
matrix_picture(saved.dissimilarity, [model.label for model in models], "matrix.png")
