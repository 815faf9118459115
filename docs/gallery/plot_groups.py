"""
Do two groups differ in shape?
==============================

A permutation test needs only the matrix of distances. The labels are exchanged at random; the p-value is the share of
exchanges whose energy distance is at least that of the true labels.
"""

from curvematch_jax import distance_matrix
from curvematch_jax.datasets import leaves
from curvematch_jax.pictures import matrix_picture
from curvematch_jax.statistics import energy_test, variance_test

sample = leaves(20, seed=1, apart=0.3)
matrix = distance_matrix(sample.curves)  # (20, 20), radians

print("energy test, any difference:  p =", energy_test(matrix, sample.groups).p)
print("variance test, mean or spread: p =", variance_test(matrix, sample.groups).p)

matrix_picture(matrix, [f"group {g}" for g in sample.groups], "matrix.png")
