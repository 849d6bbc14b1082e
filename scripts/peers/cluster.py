"""Clustering of others on the texels of one bench, from the same first centres.

    cluster.py FOLDER PASSES [PEER...]

FOLDER holds vectors.bin (u8 [texels, stride], L* codes of the directions, pads are 0), weights.bin (f64 [stride], what
each byte weighs in the distance, 0 for pads), seeds.bin (u32 [clusters], the texels of the first centres) and
shape.json. Prints a JSON object a line for each peer, all unless some are named:

faiss-kmeans        faiss.Kmeans, L2
sklearn-lloyd       scikit-learn KMeans, L2
sklearn-elkan       the same with bounds
sklearn-minibatch   scikit-learn MiniBatchKMeans, L2, batches of 2048; a pass is an epoch, and it may stop early
numba-kmedians      the plain algorithm with L1 in numba and medians by numpy, on texels times weights
faiss-l1            faiss IndexFlat METRIC_L1: distances only, unweighted, of the first 2048 texels to the first centres

Peers of L2 get the bytes as they are, without weights: they solve an easier problem than ours, as their distance is a
matrix product. Therefore the objective of all is ours, from their final centres: the mean over texels of the
weighted mean |dL*| to the nearest centre. Neither it nor the conversion to f32 (times weights) nor compiling counts
into the seconds. cpu_seconds are those of all threads, 2 unless OMP_NUM_THREADS says otherwise;
distances_per_cpu_second leaves the medians out. In favour of the peers, threads wait asleep and OpenBLAS has one:
spinning, they count as work, which can make the seconds of Elkan several times as many.

Needs numpy, and faiss-cpu, scikit-learn and numba for their peers; a peer whose library is missing is skipped.
Without numba there is no objective.
"""

import json
import os
import sys
import time

THREADS = int(os.environ.setdefault("OMP_NUM_THREADS", "2"))
os.environ.setdefault("NUMBA_NUM_THREADS", str(THREADS))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import numpy as np  # noqa: E402  reads these

SEARCHED = 2048
BATCH = 2048

try:
    from numba import njit, prange
except ImportError:
    njit = None


class Data:
    def __init__(self, folder):
        def read(name, kind):
            return np.fromfile(os.path.join(folder, name), kind)

        with open(os.path.join(folder, "shape.json")) as file:
            shape = json.load(file)
        self.texels = read("vectors.bin", np.uint8).reshape(shape["texels"], shape["stride"]).astype(np.float32)
        self.weights = read("weights.bin", "<f8").astype(np.float32)
        self.weighted = self.texels * self.weights
        self.first = self.texels[read("seeds.bin", "<u4")]
        self.clusters = shape["clusters"]
        self.unit = shape["directions_weight"] * shape["codes_per_lightness"]
        if self.first.shape[0] != self.clusters or self.weights.shape[0] != shape["stride"]:
            sys.exit(f"{folder}: seeds or weights do not fit shape.json")


def timed(work):
    """What work returns, and the seconds of processor and clock."""
    wall, cpu = time.perf_counter(), time.process_time()
    result = work()
    return result, time.process_time() - cpu, time.perf_counter() - wall


if njit:
    STRIP = 256

    @njit(parallel=True, fastmath=True)
    def nearest(texels, centres):
        labels = np.empty(len(texels), np.int64)
        for t in prange(len(texels)):
            best = np.float32(3e38)  # fastmath knows no infinity
            for c in range(len(centres)):
                distance = np.float32(0)
                for d in range(texels.shape[1]):
                    distance += abs(texels[t, d] - centres[c, d])
                if distance < best:
                    best = distance
                    labels[t] = c
        return labels

    @njit(parallel=True, fastmath=True)
    def costs(texels, centres):
        """The L1 distance of each texel to its nearest centre."""
        found = np.empty(len(texels), np.float64)
        for t in prange(len(texels)):
            best = 1e300
            for c in range(len(centres)):
                distance = 0.0
                for first in range(0, texels.shape[1], STRIP):
                    strip = np.float32(0)
                    for d in range(first, min(first + STRIP, texels.shape[1])):
                        strip += abs(texels[t, d] - centres[c, d])
                    distance += strip
                    if distance >= best:
                        break
                best = min(best, distance)
            found[t] = best
        return found


def medians(texels, labels, centres):
    """Replaces centres by the lower medians of their members; one without members stays."""
    for c in range(len(centres)):
        members = np.ascontiguousarray(texels[labels == c].T)
        if members.shape[1]:
            middle = (members.shape[1] - 1) // 2
            centres[c] = np.partition(members, middle, axis=1)[:, middle]


def objective(data, centres):
    if not njit:
        return None
    return float(costs(data.weighted, centres.astype(np.float32) * data.weights).mean() / data.unit)


def measured(data, passes, cpu, wall, centres, **more):
    return {"passes": passes, "cpu_seconds": cpu, "wall_seconds": wall, "objective": objective(data, centres), **more}


def faiss_kmeans(data, passes):
    import faiss

    faiss.omp_set_num_threads(THREADS)
    limits = {"max_points_per_centroid": 10**9, "min_points_per_centroid": 1}
    kmeans = faiss.Kmeans(data.texels.shape[1], data.clusters, niter=passes, **limits)
    _, cpu, wall = timed(lambda: kmeans.train(data.texels, init_centroids=data.first))
    return measured(data, len(kmeans.iteration_stats), cpu, wall, kmeans.centroids)


def sklearn_fit(data, model):
    _, cpu, wall = timed(lambda: model.fit(data.texels))
    return measured(data, int(model.n_iter_), cpu, wall, model.cluster_centers_)


def sklearn_kmeans(data, passes, algorithm):
    from sklearn.cluster import KMeans

    first = {"init": data.first, "n_init": 1}
    return sklearn_fit(data, KMeans(data.clusters, max_iter=passes, tol=0, algorithm=algorithm, **first))


def sklearn_minibatch(data, passes):
    from sklearn.cluster import MiniBatchKMeans

    first = {"init": data.first, "n_init": 1, "random_state": 1}
    return sklearn_fit(data, MiniBatchKMeans(data.clusters, max_iter=passes, batch_size=BATCH, **first))


def numba_kmedians(data, passes):
    if not njit:
        raise ImportError("No module named 'numba'")

    def run(texels, centres):
        labels, assigning, _ = timed(lambda: nearest(texels, centres))
        for _ in range(passes - 1):
            medians(texels, labels, centres)
            labels, cpu, _ = timed(lambda: nearest(texels, centres))
            assigning += cpu
        return assigning

    nearest(data.weighted[:4], data.weighted[:4])  # compiles
    centres = data.first * data.weights
    assigning, cpu, wall = timed(lambda: run(data.weighted, centres))
    centres /= np.where(data.weights > 0, data.weights, 1)
    rate = len(data.texels) * data.clusters * passes / assigning
    return measured(data, passes, cpu, wall, centres, distances_per_cpu_second=rate)


def faiss_l1(data, _passes):
    import faiss

    faiss.omp_set_num_threads(THREADS)
    index = faiss.IndexFlat(data.texels.shape[1], faiss.METRIC_L1)
    index.add(data.first)
    some = data.texels[:SEARCHED]
    _, cpu, _ = timed(lambda: index.search(some, 1))
    return {"distances_per_cpu_second": len(some) * data.clusters / cpu, "note": "without weights"}


PEERS = {
    "faiss-kmeans": faiss_kmeans,
    "sklearn-lloyd": lambda data, passes: sklearn_kmeans(data, passes, "lloyd"),
    "sklearn-elkan": lambda data, passes: sklearn_kmeans(data, passes, "elkan"),
    "sklearn-minibatch": sklearn_minibatch,
    "numba-kmedians": numba_kmedians,
    "faiss-l1": faiss_l1,
}


def main():
    if len(sys.argv) < 3 or not set(sys.argv[3:]) <= set(PEERS):
        sys.exit(__doc__)
    data, passes = Data(sys.argv[1]), int(sys.argv[2])
    for peer in sys.argv[3:] or PEERS:
        try:
            result = PEERS[peer](data, passes)
        except ImportError as error:
            result = {"skipped": str(error)}
        print(json.dumps({"peer": peer, **result}), flush=True)


if __name__ == "__main__":
    main()
