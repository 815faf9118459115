"""Every measure of every baseline on labelled folders of meshes, or on generated creatures.

    python -m benchmarks.baselines [DIR...] [--out FILE.json]

A DIR has `labels.csv` with the columns `file,class`, or a folder of meshes per class. Meshes are cleaned and described
in worker processes; seconds are those of describing one model, after its cleaning.
"""

from ._run import main

if __name__ == "__main__":
    main()
