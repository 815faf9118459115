"""
A ranking that explains itself
==============================

A query is ranked against a collection. The ranking says which part of the query matched which part of an object, at
what distance, and how much of the belief that gave.
"""

from curvematch_jax import creatures, extract_parts, rank
from curvematch_jax.pictures import explanation_picture, masses_picture

models = list(creatures(["horse", "human", "snake"], poses=2))  # or load_mesh("horse.off") for each of your files
query, *collection = [extract_parts(model.mesh) for model in models]
ranking = rank(query, collection)

for j in ranking.order:
    print(f"{ranking.names[j]:8} {ranking.probability[j]:.3f}")

# %%
# Which part of the first horse matched which part of the second one.

for match in ranking.explain(ranking.order[0]):
    print(f"part {match.part} matched part {match.other} at distance {match.distance:.3f}, mass {match.mass:.3f}")

# %%
# The same as a picture: matched parts have the same colour and the same number.

meshes = {j: model.mesh for j, model in enumerate(models[1:])}
explanation_picture(query, collection, ranking, "explanation.png", top=2, mesh=models[0].mesh, meshes=meshes)

# %%
# The masses of all parts of the query on all objects.

masses_picture(ranking, "masses.png")
