// OctoMap's castRay on the voxels and rays of `mrol-lab bench rays --peer-file`, one thread.
//
//     apt install liboctomap-dev g++
//     g++ -O3 -march=native -o target/octomap crates/lab/benches/peers/octomap.cpp -loctomap -loctomath
//     mrol-lab bench rays --peer-file target/rays.bin && target/octomap target/rays.bin
//
// The layout of the file is in crates/lab/src/measure/peer_file.rs. Prints nanoseconds a ray of processor time, the median of some
// passes after one that is not timed, and how many rays end otherwise. OctoMap tells the center of the voxel that it hit: a
// ray ends alike where that lies within a voxel's diagonal of the distance in the file, or where both hit nothing.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <vector>

#include <octomap/octomap.h>

template <typename T> static T read(std::istream &file) {
    T value;
    file.read(reinterpret_cast<char *>(&value), sizeof value);
    return value;
}

struct Ray {
    float origin[3], direction[3], distance_m;
};

static double pass_ns(const octomap::OcTree &tree, const std::vector<Ray> &rays, double range_m, size_t *differ) {
    const double diagonal_m = std::sqrt(3.0) * tree.getResolution();
    size_t different = 0;
    const std::clock_t start = std::clock();
    for (const Ray &ray : rays) {
        const octomap::point3d origin(ray.origin[0], ray.origin[1], ray.origin[2]);
        const octomap::point3d direction(ray.direction[0], ray.direction[1], ray.direction[2]);
        octomap::point3d end;
        const bool hit = tree.castRay(origin, direction, end, true, range_m);
        const bool same = hit ? std::fabs((end - origin).norm() - ray.distance_m) <= diagonal_m : std::isinf(ray.distance_m);
        different += !same;
    }
    const double elapsed_ns = double(std::clock() - start) / CLOCKS_PER_SEC * 1e9;
    *differ = different;
    return elapsed_ns / rays.size();
}

int main(int count, char **arguments) {
    if (count < 2) {
        std::fprintf(stderr, "usage: octomap FILE [PASSES]\n");
        return 2;
    }
    std::ifstream file(arguments[1], std::ios::binary);
    char magic[8];
    file.read(magic, sizeof magic);
    if (!file || std::memcmp(magic, "mrolpeer", sizeof magic) != 0) {
        std::fprintf(stderr, "%s is no file of mrol-lab bench rays --peer-file\n", arguments[1]);
        return 1;
    }
    const double voxel_m = read<double>(file), range_m = read<double>(file);
    octomap::OcTree tree(voxel_m);
    const uint64_t voxels = read<uint64_t>(file);
    for (uint64_t i = 0; i < voxels; ++i) {
        double center_m[3];
        for (double &c : center_m) c = (read<int32_t>(file) + 0.5) * voxel_m;
        tree.updateNode(octomap::point3d(center_m[0], center_m[1], center_m[2]), true, true);
    }
    tree.updateInnerOccupancy();
    std::vector<Ray> rays(read<uint64_t>(file));
    for (Ray &ray : rays) ray = read<Ray>(file);

    size_t differ = 0;
    pass_ns(tree, rays, range_m, &differ);
    std::vector<double> passes(count > 2 ? std::max(1, std::atoi(arguments[2])) : 3);
    for (double &ns : passes) ns = pass_ns(tree, rays, range_m, &differ);
    std::sort(passes.begin(), passes.end());
    std::printf("octomap: %zu voxels, %zu rays, %.1f ns a ray, %zu end otherwise\n", (size_t)voxels, rays.size(),
                passes[passes.size() / 2], differ);
}
