"""k-means of a peer, for the program `codebooks`.

kmeans.py VECTORS CENTROIDS dimension words rounds seed method
VECTORS: raw f32. CENTROIDS: where the words go, raw f32. method: faiss, lloyd or elkan (scikit-learn).
Threads: OMP_NUM_THREADS and OPENBLAS_NUM_THREADS of the environment. Prints the seconds of training
alone: neither imports nor files.
"""
import sys
import time

import numpy as np

vectors, centroids, *numbers, method = sys.argv[1:]
dimension, words, rounds, seed = map(int, numbers)
x = np.fromfile(vectors, np.float32).reshape(-1, dimension)
if method == "faiss":
    import os

    import faiss

    faiss.omp_set_num_threads(int(os.environ["OMP_NUM_THREADS"]))
    k = faiss.Kmeans(dimension, words, niter=rounds, seed=seed, max_points_per_centroid=10**6)
    start = time.perf_counter()
    k.train(x)
    seconds = time.perf_counter() - start
    found = k.centroids
else:
    from sklearn.cluster import KMeans

    k = KMeans(words, init="k-means++", n_init=1, algorithm=method, max_iter=rounds, tol=0,
               random_state=seed)
    start = time.perf_counter()
    k.fit(x)
    seconds = time.perf_counter() - start
    found = k.cluster_centers_
np.ascontiguousarray(found, np.float32).tofile(centroids)
print(seconds)
