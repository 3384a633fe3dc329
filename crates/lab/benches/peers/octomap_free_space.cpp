// OctoMap's free and occupied voxels from the scans of `mrol-lab experiment free-space --peer-scans`.
//
//     apt install liboctomap-dev g++
//     g++ -O3 -march=native -o target/octomap_free_space crates/lab/benches/peers/octomap_free_space.cpp -loctomap -loctomath
//     target/octomap_free_space scans.bin states.bin
//
// The layouts of both files are in crates/lab/src/experiment/free_space.rs. Every scan goes in by insertPointCloud with OctoMap's own
// settings and the range of the file; leaves larger than a voxel are written voxel by voxel.

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>

#include <octomap/octomap.h>

template <typename T> static T read(std::istream &file) {
    T value;
    file.read(reinterpret_cast<char *>(&value), sizeof value);
    return value;
}

template <typename T> static void write(std::ostream &file, T value) {
    file.write(reinterpret_cast<const char *>(&value), sizeof value);
}

static octomap::point3d read_point(std::istream &file) {
    const float x = read<float>(file), y = read<float>(file), z = read<float>(file);
    return octomap::point3d(x, y, z);
}

int main(int count, char **arguments) {
    if (count < 3) {
        std::fprintf(stderr, "usage: octomap_free_space SCANS STATES\n");
        return 2;
    }
    std::ifstream scans(arguments[1], std::ios::binary);
    char magic[8];
    scans.read(magic, sizeof magic);
    if (!scans || std::memcmp(magic, "mrolscan", sizeof magic) != 0) {
        std::fprintf(stderr, "%s is no file of mrol-lab experiment free-space --peer-scans\n", arguments[1]);
        return 1;
    }
    octomap::OcTree tree(read<double>(scans));
    const double range_m = read<double>(scans);
    for (uint64_t scan = read<uint64_t>(scans); scan > 0; --scan) {
        const octomap::point3d origin = read_point(scans);
        octomap::Pointcloud cloud;
        for (uint64_t i = read<uint64_t>(scans); i > 0; --i) cloud.push_back(read_point(scans));
        tree.insertPointCloud(cloud, origin, range_m);
    }

    std::ofstream states(arguments[2], std::ios::binary);
    states.write("mrolstat", 8);
    write<uint64_t>(states, tree.memoryUsage());
    uint64_t voxels = 0, written = 0;
    for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
        const uint64_t side = uint64_t(1) << (tree.getTreeDepth() - leaf.getDepth());
        voxels += side * side * side;
    }
    write(states, voxels);
    const int32_t middle = 1 << (tree.getTreeDepth() - 1);
    for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
        const int32_t side = 1 << (tree.getTreeDepth() - leaf.getDepth());
        const octomap::OcTreeKey first = leaf.getIndexKey();
        const uint8_t occupied = tree.isNodeOccupied(*leaf);
        for (int32_t x = 0; x < side; ++x)
            for (int32_t y = 0; y < side; ++y)
                for (int32_t z = 0; z < side; ++z) {
                    write<int32_t>(states, first[0] - middle + x);
                    write<int32_t>(states, first[1] - middle + y);
                    write<int32_t>(states, first[2] - middle + z);
                    write(states, occupied);
                    ++written;
                }
    }
    std::printf("octomap: %zu bytes, %zu voxels written\n", tree.memoryUsage(), (size_t)written);
    return states ? 0 : 1;
}
