"""
The halves of a centaur
=======================

A centaur is part human and part horse. ``Matching.partial()`` is the preset for such queries: a few close parts are
enough to rank an object highly. Horse and human are ranked before the other objects. The explanation shows why: the
head matches the human's head, legs and tail match the horse's.
"""

from curvematch_jax import Matching, creature, extract_parts, rank
from curvematch_jax.pictures import explanation_picture

centaur = creature("centaur").mesh
models = [creature(kind, pose=1).mesh for kind in ("human", "horse", "snake", "teapot")]
query, collection = extract_parts(centaur), [extract_parts(mesh) for mesh in models]

ranking = rank(query, collection, Matching.partial())
for j in ranking.order:
    print(f"{ranking.names[j]:8} {ranking.probability[j]:.3f}")

# %%
# Where each part of the centaur found its nearest part.

for part, row in enumerate(ranking.distances):
    print(f"part {part}: {ranking.names[row.argmin()]}, distance {row.min():.3f}")

# %%
# Matched parts of the centaur and of the two best objects.

meshes = dict(enumerate(models))
explanation_picture(query, collection, ranking, "centaur.png", top=2, mesh=centaur, meshes=meshes)
