"""
A matrix of distances in scikit-learn
=====================================

A distance matrix fits every estimator of scikit-learn that takes ``metric="precomputed"``: neighbours, clusters,
embeddings. :class:`~curvematch_jax.statistics.ShapeTransformer` gives vectors to all others.
"""

from sklearn.cluster import AgglomerativeClustering
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.manifold import MDS
from sklearn.model_selection import cross_val_score
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline

from curvematch_jax import Aligner, distance_matrix
from curvematch_jax.datasets import leaves
from curvematch_jax.pictures import scores_picture
from curvematch_jax.statistics import ShapeTransformer

sample = leaves(20, seed=1, apart=0.5)
matrix = distance_matrix(sample.curves)

nearest = KNeighborsClassifier(1, metric="precomputed")
print("nearest neighbour:", cross_val_score(nearest, matrix, sample.groups, cv=4).mean())

clusters = AgglomerativeClustering(2, metric="precomputed", linkage="average").fit_predict(matrix)
print("clusters:", clusters)
print("groups:  ", sample.groups)

# %%
# Linear discriminant analysis on the scores of the first three components. The mean and the components are computed
# anew from the training part of each fold.

classifier = make_pipeline(ShapeTransformer(n_components=3, aligner=Aligner.fast()), LinearDiscriminantAnalysis())
print("discriminant analysis:", cross_val_score(classifier, sample.curves, sample.groups, cv=2).mean())

# %%
# An embedding in the plane, by multidimensional scaling.

plane = MDS(metric="precomputed", init="classical_mds", n_init=1, random_state=0).fit_transform(matrix)
scores_picture(plane, "plane.png", [f"group {g}" for g in sample.groups])
