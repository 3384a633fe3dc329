// RRT-Connect of OMPL for a drone of spheres, among the voxels of a map: asked of a copy of the map in this process (mrol), or of
// FCL with an octree of OctoMap.
//
//     plans mrol ADDRESS MAP PAIRS RESOLUTION PADDING
//     plans fcl VOXELS - PAIRS RESOLUTION PADDING
//
// PAIRS has the corners of the space, low and high, and then starts and goals, three doubles each. VOXELS are the centers of the map's
// voxels, three doubles each. Prints for each pair "milliseconds x y z x y z ...", or milliseconds alone where no path was found.
// compare.py runs it, and checks the paths.
#include <chrono>
#include <cstdio>
#include <fcl/fcl.h>
#include <fstream>
#include <memory>
#include <mrol.hpp>
#include <octomap/octomap.h>
#include <ompl/base/MotionValidator.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/RandomNumbers.h>
#include <string>
#include <vector>

namespace ob = ompl::base;
namespace og = ompl::geometric;

using place = std::array<double, 3>;

static const double SECONDS_MAX = 10;
// Where the drone is moved to.
static const std::vector<mrol::sphere> DRONE = {{0, 0, 0, 0.12f},         {0, 0, -0.09f, 0.08f},     {0.16f, 0.16f, 0.03f, 0.11f},
                                                {0.16f, -0.16f, 0.03f, 0.11f}, {-0.16f, 0.16f, 0.03f, 0.11f}, {-0.16f, -0.16f, 0.03f, 0.11f}};

static place place_of(const ob::State *state) {
    const double *values = state->as<ob::RealVectorStateSpace::StateType>()->values;
    return {values[0], values[1], values[2]};
}

// Answers whether the drone fits.
struct checker {
    virtual ~checker() = default;
    virtual bool fits(const place &at) const = 0;
    virtual bool fits_along(const place &from, const place &to) const = 0;
};

static std::vector<mrol::sphere> padded(float padding) {
    std::vector<mrol::sphere> spheres = DRONE;
    for (mrol::sphere &sphere : spheres) sphere.radius += padding;
    return spheres;
}

// A copy of the map, which is asked about all of a motion at once.
struct by_replica : checker {
    mrol::replica replica;
    mrol::body drone;

    by_replica(const char *address, const char *map, float padding) : replica(address, map), drone(padded(padding)) {}
    bool fits(const place &at) const override {
        return replica.collide(drone, {mrol::pose(at[0], at[1], at[2])}).count() == 0;
    }
    bool fits_along(const place &from, const place &to) const override {
        float numbers[14] = {};
        for (int axis = 0; axis < 3; axis++) {
            numbers[axis] = static_cast<float>(from[axis]);
            numbers[7 + axis] = static_cast<float>(to[axis]);
        }
        numbers[6] = numbers[13] = 1;
        return replica.is_free(drone, numbers, 2);
    }
};

// An octree, in which each sphere of a place is looked up; of a motion as many places as the replica checks.
struct by_octree : checker {
    std::unique_ptr<fcl::CollisionObjectd> tree;
    std::vector<fcl::Sphered> shapes;
    double step;

    by_octree(const std::vector<place> &voxels, double resolution, double padding) : step(resolution / 2) {
        auto octree = std::make_shared<octomap::OcTree>(resolution);
        for (const place &center : voxels) {
            octree->updateNode(octomap::point3d(float(center[0]), float(center[1]), float(center[2])), true, true);
        }
        octree->updateInnerOccupancy();
        octree->prune();
        std::shared_ptr<const octomap::OcTree> shared = octree;
        tree = std::make_unique<fcl::CollisionObjectd>(std::make_shared<fcl::OcTreed>(shared));
        for (const mrol::sphere &sphere : DRONE) shapes.emplace_back(sphere.radius + padding);
    }
    bool fits(const place &at) const override {
        const fcl::CollisionRequestd request(1, false);
        for (std::size_t i = 0; i < shapes.size(); i++) {
            fcl::Transform3d moved = fcl::Transform3d::Identity();
            moved.translation() << at[0] + DRONE[i].x, at[1] + DRONE[i].y, at[2] + DRONE[i].z;
            fcl::CollisionResultd result;
            fcl::collide(&shapes[i], moved, tree->collisionGeometry().get(), fcl::Transform3d::Identity(), request, result);
            if (result.isCollision()) return false;
        }
        return true;
    }
    bool fits_along(const place &from, const place &to) const override {
        const fcl::Vector3d way(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
        const int steps = std::max(1, static_cast<int>(std::ceil(way.norm() / step)));
        for (int i = 0; i <= steps; i++) {
            const double share = static_cast<double>(i) / steps;
            if (!fits({from[0] + share * way[0], from[1] + share * way[1], from[2] + share * way[2]})) return false;
        }
        return true;
    }
};

struct motions : ob::MotionValidator {
    const checker &asked;

    motions(const ob::SpaceInformationPtr &space, const checker &asked) : ob::MotionValidator(space), asked(asked) {}
    bool checkMotion(const ob::State *from, const ob::State *to) const override {
        return asked.fits_along(place_of(from), place_of(to));
    }
    bool checkMotion(const ob::State *from, const ob::State *to, std::pair<ob::State *, double> &last) const override {
        last.second = 0;
        return checkMotion(from, to);
    }
};

static std::vector<place> places_of(const char *path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<place> places;
    for (place at; file.read(reinterpret_cast<char *>(at.data()), sizeof at);) places.push_back(at);
    return places;
}

static void plan(const checker &asked, const place &low, const place &high, const place &start, const place &goal) {
    auto space = std::make_shared<ob::RealVectorStateSpace>(3);
    ob::RealVectorBounds bounds(3);
    for (int axis = 0; axis < 3; axis++) bounds.setLow(axis, low[axis]), bounds.setHigh(axis, high[axis]);
    space->setBounds(bounds);
    og::SimpleSetup setup(space);
    setup.setStateValidityChecker([&asked](const ob::State *state) { return asked.fits(place_of(state)); });
    setup.getSpaceInformation()->setMotionValidator(std::make_shared<motions>(setup.getSpaceInformation(), asked));
    ob::ScopedState<ob::RealVectorStateSpace> from(space), to(space);
    for (int axis = 0; axis < 3; axis++) from[axis] = start[axis], to[axis] = goal[axis];
    setup.setStartAndGoalStates(from, to);
    setup.setPlanner(std::make_shared<og::RRTConnect>(setup.getSpaceInformation()));
    setup.setup();

    const auto begin = std::chrono::steady_clock::now();
    const bool is_found = setup.solve(SECONDS_MAX) == ob::PlannerStatus::EXACT_SOLUTION;
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    std::printf("%.4f", took.count());
    if (is_found) {
        for (const ob::State *state : setup.getSolutionPath().getStates()) {
            for (double coordinate : place_of(state)) std::printf(" %.9g", coordinate);
        }
    }
    std::printf("\n");
}

static void run(char **words) {
    ompl::msg::setLogLevel(ompl::msg::LOG_ERROR);
    ompl::RNG::setSeed(1);
    const double resolution = std::atof(words[5]), padding = std::atof(words[6]);
    const std::vector<place> pairs = places_of(words[4]);
    std::unique_ptr<checker> asked;
    if (std::string(words[1]) == "mrol") {
        asked = std::make_unique<by_replica>(words[2], words[3], static_cast<float>(padding));
    } else {
        asked = std::make_unique<by_octree>(places_of(words[2]), resolution, padding);
    }
    // What is learned of a place for the first time belongs to no plan.
    for (std::size_t i = 2; i + 1 < pairs.size(); i += 2) asked->fits_along(pairs[i], pairs[i + 1]);
    for (std::size_t i = 2; i + 1 < pairs.size(); i += 2) plan(*asked, pairs[0], pairs[1], pairs[i], pairs[i + 1]);
}

int main(int count, char **words) {
    if (count != 7) {
        std::fprintf(stderr, "plans mrol ADDRESS MAP PAIRS RESOLUTION PADDING, or fcl VOXELS - PAIRS RESOLUTION PADDING\n");
        return 2;
    }
    try {
        run(words);
        return 0;
    } catch (const std::exception &failed) {
        std::fprintf(stderr, "%s\n", failed.what());
        return 1;
    }
}
