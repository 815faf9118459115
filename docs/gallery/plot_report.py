"""
A result as one HTML file
=========================

A matrix of dissimilarities becomes a report: measures, the matrix, the ranking of each query, and matched parts on both
surfaces in 3-D. It is one file that opens without a network. ``curvematch report`` makes the same from files.
"""

from curvematch_jax import creatures, extract_parts
from curvematch_jax.pictures import matrix_picture
from curvematch_jax.report import Limits, report_page, write_report
from curvematch_jax.retrieval import Matching, SavedMatrix, dissimilarity_matrix, run_settings

models = list(creatures(["horse", "human", "snake"], poses=2))
parts = [extract_parts(model.mesh) for model in models]
labels, names = [model.label for model in models], [model.mesh.name for model in models]

# A matrix remembers the settings that made it. One that `curvematch matrix` wrote is read with `load_matrix`.
settings = run_settings(parts[0].settings, Matching())
saved = SavedMatrix(dissimilarity_matrix(parts), tuple(names), settings)
matrix_picture(saved.dissimilarity, labels, "matrix.png")

# %%
# The report has this matrix as well, with names and values under the pointer. Choose a query and one of its objects in
# *Rankings*: *Matched parts* shows the two side by side. Matched parts have the same colour and the same number, and
# the table says how far apart they are and how much of the belief they gave. Turn the surfaces with the mouse or with
# the arrow keys.

meshes = {model.mesh.name: model.mesh for model in models}
smaller = Limits(vertices=500)
page = report_page(saved, labels, parts, meshes, title="Six creatures", limits=smaller)
write_report(page, "report.html")
