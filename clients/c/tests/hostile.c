/* Passes every kind of damaged argument; each is a code and a message, and nothing else happens.
 *
 *     hostile ADDRESS MAP      of a map of 0.1 m with three occupied voxels about (0.05 .. 0.25, 0.05, 0.05)
 */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <mrol.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#define MUST(condition)                                                     \
    do {                                                                    \
        if (!(condition)) {                                                 \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
            exit(1);                                                        \
        }                                                                   \
    } while (0)

static const mrol_replica NONE = {0};

/* The call fails with the code, and its message has the words. */
#define FAILS(call, expected, words)                                            \
    do {                                                                        \
        mrol_error error;                                                       \
        memset(&error, 0x55, sizeof error);                                     \
        MUST((call) == (expected));                                             \
        MUST(error.code == (expected) && error.reserved == 0);                  \
        MUST(memchr(error.reason, 0, sizeof error.reason) != NULL);             \
        MUST(memchr(error.message, 0, sizeof error.message) != NULL);           \
        if (strstr(error.message, (words)) == NULL) {                           \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, error.message);  \
            exit(1);                                                            \
        }                                                                       \
    } while (0)

static void *misaligned(void *pointer) {
    return (char *)pointer + 1;
}

static mrol_replica_options options_for(const char *address, const char *map) {
    mrol_replica_options options = mrol_replica_options_default();
    options.address = address;
    options.map = map;
    return options;
}

static void bad_options(const char *address, const char *map) {
    mrol_replica replica = {99};
    mrol_replica_options good = options_for(address, map), options;
    char *far_too_long = (char *)malloc(5001);
    struct {
        mrol_replica_options known;
        uint64_t unknown;
    } newer;
    MUST(far_too_long != NULL);
    memset(far_too_long, 'a', 5000);
    far_too_long[5000] = 0;
#define OPENING_FAILS(code, words) FAILS(mrol_replica_open(&options, &replica, &error), code, words)
    FAILS(mrol_replica_open(NULL, &replica, &error), MROL_INVALID_ARGUMENT, "options is NULL");
    MUST(replica.number == 0);
    FAILS(mrol_replica_open(&good, NULL, &error), MROL_INVALID_ARGUMENT, "replica is NULL");
    FAILS(mrol_replica_open(misaligned(&good), &replica, &error), MROL_INVALID_ARGUMENT, "options is at address");
    options = good, options.struct_size = 0;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "struct_size must lie in");
    options = good, options.struct_size = SIZE_MAX;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "struct_size must lie in");
    newer.known = good, newer.known.struct_size = sizeof newer, newer.unknown = 1;
    FAILS(mrol_replica_open(&newer.known, &replica, &error), MROL_INVALID_ARGUMENT, "too old");
    options = good, options.address = NULL;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.address is NULL");
    options = good, options.address = "nothing like it";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "is no server address");
    options = good, options.address = "http://u:secret@127.0.0.1:1";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "without a user, a path or a query; what was given is not shown");
    options = good, options.address = far_too_long;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.address has more than 4096 bytes");
    options = good, options.map = NULL;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.map is NULL");
    options = good, options.map = "";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "");
    options = good, options.map = "\xff\xfe";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.map is not UTF-8");
    options = good, options.key = "two words";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "the key must be");
    options = good, options.ca_file = "/nowhere/ca.pem";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.ca_file: /nowhere/ca.pem cannot be read");
    options = good, options.ca_file = "/proc/self/status";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "must be PEM");
    options = good, options.ca_file = "/dev/zero";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.ca_file: /dev/zero is no regular file");
    options = good, options.certificate_file = "/proc/self/status";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "one of certificate_file and private_key_file");
    options = good, options.has_region = 2;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.has_region must be 0 or 1, got 2");
    options = good, options.with_filter = 255;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.with_filter must be 0 or 1, got 255");
    options = good, options.without_viewpoints = 2;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.without_viewpoints must be 0 or 1, got 2");
    options = good, options.reserved[4] = 1;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.reserved must be zero");
    options = good, options.has_region = 1, options.region_min_m[1] = 1.0;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "");
    options = good, options.has_region = 1, options.region_min_m[1] = NAN;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "");
    options = good, options.blocks_max = 1, options.has_region = 0;
    MUST(mrol_replica_open(&options, &replica, NULL) == MROL_OK);
    MUST(mrol_replica_close(replica, NULL) == MROL_OK);
    options = options_for(address, "no_such_map");
    OPENING_FAILS(MROL_REFUSED, "no_such_map");
    options = options_for("http://127.0.0.1:1", map);
    OPENING_FAILS(MROL_UNREACHABLE, "http://127.0.0.1:1");
    MUST(mrol_replica_open(&options, &replica, NULL) == MROL_UNREACHABLE && replica.number == 0);
    /* The error itself. */
    MUST(mrol_replica_open(&good, &replica, misaligned(&options)) == MROL_INVALID_ARGUMENT);
    free(far_too_long);
}

static void bad_queries(mrol_replica replica) {
    float xyz[9] = {0.05f, 0.05f, 0.05f, 0.15f, 0.05f, 0.05f, 5.0f, 5.0f, 5.0f};
    double pose[7] = {0, 0, 0, 0, 0, 0, 1};
    uint8_t occupied[2] = {0xaa, 0xaa};
    mrol_answer answer;
    mrol_point_query good = mrol_point_query_default(), query;
    good.xyz = xyz, good.count = 3, good.map_from_points = pose;
#define QUERY(question, to, bytes) mrol_replica_query_points(replica, question, to, bytes, &answer, &error)
#define QUERY_FAILS(words) FAILS(QUERY(&query, occupied, sizeof occupied), MROL_INVALID_ARGUMENT, words)
    memset(&answer, 0x55, sizeof answer);
    FAILS(QUERY(NULL, occupied, 1), MROL_INVALID_ARGUMENT, "query is NULL");
    FAILS(QUERY(misaligned(&good), occupied, 1), MROL_INVALID_ARGUMENT, "query is at address");
    FAILS(QUERY(&good, NULL, 1), MROL_INVALID_ARGUMENT, "occupied is NULL");
    FAILS(QUERY(&good, occupied, 0), MROL_INVALID_ARGUMENT, "occupied_bytes must be at least 1");
    FAILS(QUERY(&good, (uint8_t *)xyz + 35, 1), MROL_INVALID_ARGUMENT, "occupied overlaps");
    query = good, query.struct_size = 1;
    QUERY_FAILS("query.struct_size");
    query = good, query.xyz = NULL;
    QUERY_FAILS("query.xyz is NULL");
    query = good, query.xyz = misaligned(xyz);
    QUERY_FAILS("query.xyz is at address");
    query = good, query.map_from_points = misaligned(pose);
    QUERY_FAILS("query.map_from_points is at address");
    query = good, query.count = MROL_POINTS_MAX + 1;
    FAILS(QUERY(&query, occupied, SIZE_MAX), MROL_INVALID_ARGUMENT, "query.count must be at most 134217728");
    query = good, query.count = SIZE_MAX;
    FAILS(QUERY(&query, occupied, SIZE_MAX), MROL_INVALID_ARGUMENT, "query.count must be at most 134217728");
    query = good, query.level = 4;
    QUERY_FAILS("level must lie in 0..=3, got 4");
    query = good, query.level = UINT32_MAX;
    QUERY_FAILS("level must lie in");
    query = good, query.lookup = 2;
    QUERY_FAILS("query.lookup must be 0 or 1, got 2");
    query = good, query.lookup = -1;
    QUERY_FAILS("query.lookup must be 0 or 1, got -1");
    query = good, query.keep_out = 2;
    QUERY_FAILS("query.keep_out must be 0 or 1, got 2");
    query = good, query.reserved[6] = 1;
    QUERY_FAILS("query.reserved must be zero");
    pose[6] = 2.0;
    query = good;
    QUERY_FAILS("unit quaternion");
    pose[6] = 1.0, pose[1] = NAN;
    QUERY_FAILS("translation_m must be finite");
    pose[1] = 0.0, xyz[4] = INFINITY;
    QUERY_FAILS("points[1]");
    xyz[4] = 1e30f;
    QUERY_FAILS("points[1]");
    xyz[4] = 0.05f;
    MUST(mrol_replica_query_points(replica, &good, occupied, 1, misaligned(&answer), NULL) == MROL_INVALID_ARGUMENT);
    MUST(occupied[0] == 0xaa && answer.asked == 0x5555555555555555u);
    /* And what is right, with and without what may be NULL. */
    MUST(mrol_replica_query_points(replica, &good, occupied, 1, NULL, NULL) == MROL_OK);
    MUST(occupied[0] == 0x03 && occupied[1] == 0xaa);
    good.map_from_points = NULL, good.count = 0, good.xyz = NULL;
    MUST(mrol_replica_query_points(replica, &good, NULL, 0, &answer, NULL) == MROL_OK);
    MUST(answer.asked == 0 && answer.positive == 0 && answer.version.revision == 1 && answer.reserved[3] == 0);
}

static mrol_link ball(const float *sphere) {
    mrol_link link;
    memset(&link, 0, sizeof link);
    link.spheres = sphere, link.spheres_count = 1;
    return link;
}

static void bad_bodies(void) {
    float sphere[4] = {0, 0, 0, 0.1f};
    mrol_link good = ball(sphere), link;
    mrol_body body = {99};
#define BODY_FAILS(words) FAILS(mrol_body_new(&link, 1, &body, &error), MROL_INVALID_ARGUMENT, words)
    FAILS(mrol_body_new(NULL, 1, &body, &error), MROL_INVALID_ARGUMENT, "links is NULL");
    MUST(body.number == 0);
    FAILS(mrol_body_new(NULL, 0, &body, &error), MROL_INVALID_ARGUMENT, "at least one link");
    FAILS(mrol_body_new(&good, 1, NULL, &error), MROL_INVALID_ARGUMENT, "body is NULL");
    FAILS(mrol_body_new(misaligned(&good), 1, &body, &error), MROL_INVALID_ARGUMENT, "links is at address");
    FAILS(mrol_body_new(&good, MROL_LINKS_MAX + 1, &body, &error), MROL_INVALID_ARGUMENT, "links_count must be at most 4096");
    FAILS(mrol_body_new(&good, SIZE_MAX, &body, &error), MROL_INVALID_ARGUMENT, "links_count must be at most");
    link = good, link.spheres = NULL;
    BODY_FAILS("links.spheres is NULL");
    link = good, link.spheres = misaligned(sphere);
    BODY_FAILS("links.spheres is at address");
    link = good, link.spheres_count = SIZE_MAX;
    BODY_FAILS("links.spheres: at most 134217728");
    link = good, link.points_count = 1;
    BODY_FAILS("links.points is NULL");
    link = good, link.padding_m = NAN;
    BODY_FAILS("links[0].padding_m must lie in");
    link = good, link.reserved[2] = 1;
    BODY_FAILS("links[0].reserved must be zero");
    sphere[3] = -1.0f, link = good;
    BODY_FAILS("links[0].spheres[0]");
    sphere[3] = 1001.0f;
    BODY_FAILS("links[0].spheres[0]");
    FAILS(mrol_body_free(body, &error), MROL_INVALID_ARGUMENT, "body is none");
    MUST(body.number == 0);
}

static void bad_checks(mrol_replica replica, mrol_body body) {
    float configurations[14] = {0.05f, 0.05f, 0.05f, 0, 0, 0, 1, 0.05f, 5.0f, 0.05f, 0, 0, 0, 1};
    uint8_t colliding[2] = {0xaa, 0xaa};
    uint32_t parts[3];
    float clearances[2];
    mrol_region region;
    mrol_answer answer;
    mrol_pose_check good = mrol_pose_check_default(), check;
    mrol_collisions places = mrol_collisions_default(), other;
    memset(&region, 0, sizeof region);
    good.body = body, good.configurations = configurations, good.count = 2;
    places.capacity = 2, places.colliding = colliding;
#define CHECK(check, places) mrol_replica_check_poses(replica, check, places, &answer, &error)
#define CHECK_FAILS(words) FAILS(CHECK(&check, &places), MROL_INVALID_ARGUMENT, words)
#define PLACES_FAIL(words) FAILS(CHECK(&good, &other), MROL_INVALID_ARGUMENT, words)
    FAILS(CHECK(NULL, &places), MROL_INVALID_ARGUMENT, "check is NULL");
    FAILS(CHECK(&good, NULL), MROL_INVALID_ARGUMENT, "answers is NULL");
    FAILS(CHECK(misaligned(&good), &places), MROL_INVALID_ARGUMENT, "check is at address");
    FAILS(CHECK(&good, misaligned(&places)), MROL_INVALID_ARGUMENT, "answers is at address");
    check = good, check.struct_size = 8;
    CHECK_FAILS("check.struct_size");
    check = good, check.body.number = 0;
    CHECK_FAILS("body is none");
    check = good, check.body.number = UINT64_MAX;
    CHECK_FAILS("body is none");
    check = good, check.configurations = NULL;
    CHECK_FAILS("check.configurations is NULL");
    check = good, check.configurations = misaligned(configurations);
    CHECK_FAILS("check.configurations is at address");
    check = good, check.count = SIZE_MAX / 2, other = places, other.capacity = SIZE_MAX;
    FAILS(CHECK(&check, &other), MROL_INVALID_ARGUMENT, "check.configurations: at most");
    check = good, check.scope.level = 4;
    CHECK_FAILS("level must lie in 0..=3, got 4");
    check = good, check.reserved[2] = 1;
    CHECK_FAILS("check.reserved must be zero");
    check = good, check.scope.reserved[0] = 1;
    CHECK_FAILS("check.scope.reserved must be zero");
    check = good, check.scope.ignore_keep_outs = 2;
    CHECK_FAILS("ignore_keep_outs must be 0 or 1, got 2");
    check = good, check.ignored_count = 1;
    CHECK_FAILS("ignored is NULL");
    check.ignored = &region;
    CHECK_FAILS("ignored[0]: kind must be 1");
    region.kind = MROL_REGION_BALL, region.numbers[3] = -1;
    CHECK_FAILS("ignored[0]: sphere.");
    region.numbers[3] = 1, region.numbers[4] = 1;
    CHECK_FAILS("the others must be zero");
    region.kind = MROL_REGION_ORIENTED_BOX;
    CHECK_FAILS("ignored[0]: rotation_xyzw");
    region.kind = MROL_REGION_BOX, region.numbers[0] = NAN;
    CHECK_FAILS("ignored[0]: box.min_m");
    check = good, configurations[6] = 2.0f;
    CHECK_FAILS("configurations[0].links[0]");
    configurations[6] = 1.0f, configurations[7] = NAN;
    CHECK_FAILS("configurations[1].links[0]");
    configurations[7] = 0.05f;
    other = places, other.capacity = 1;
    PLACES_FAIL("answers.capacity must be at least 2, got 1");
    other = places, other.struct_size = 0;
    PLACES_FAIL("answers.struct_size");
    other = places, other.colliding = (uint8_t *)configurations + 3;
    PLACES_FAIL("answers.colliding overlaps");
    other = places, other.hit_links = parts, other.hit_parts = parts + 1;
    PLACES_FAIL("answers.hit_parts overlaps");
    other = places, other.hit_parts = misaligned(parts);
    PLACES_FAIL("answers.hit_parts is at address");
    other = places, other.hit_parts = parts, other.clearances_m = clearances;
    PLACES_FAIL("ask for one of them");
    other = places, other.clearances_m = clearances;
    check = good, check.clearance_max_m = -1.0f;
    FAILS(CHECK(&check, &other), MROL_INVALID_ARGUMENT, "clearance_max_m");
    check.clearance_max_m = 1e9f;
    FAILS(CHECK(&check, &other), MROL_INVALID_ARGUMENT, "clearance_max_m");
    MUST(colliding[0] == 0xaa && colliding[1] == 0xaa);
    /* And what is right; a replica that is none is said before anything is read. */
    FAILS(mrol_replica_check_poses(NONE, NULL, NULL, NULL, &error), MROL_CLOSED, "not open");
    MUST(mrol_replica_check_poses(replica, &good, &places, NULL, NULL) == MROL_OK);
    MUST(colliding[0] == 0x01 && colliding[1] == 0xaa);
    good.count = 0, good.configurations = NULL, places.capacity = 0, places.colliding = NULL;
    FAILS(CHECK(&good, &places), MROL_INVALID_ARGUMENT, "configurations must not be empty");
}

static void bad_motions_and_spheres(mrol_replica replica, mrol_body body) {
    float configurations[21] = {0.05f, 2.0f, 0.05f, 0, 0, 0, 1, 0.05f, 0.05f, 0.05f, 0, 0, 0, 1, 9, 9, 9, 0, 0, 0, 1};
    float spheres[8] = {0.05f, 0.05f, 0.05f, 0.1f, 5, 5, 5, 0.1f};
    uint32_t lengths[2] = {2, 1}, sizes[2] = {1, 2};
    uint8_t bits[1];
    mrol_motion_check motions = mrol_motion_check_default();
    mrol_motion_answers answers = mrol_motion_answers_default();
    mrol_sphere_check check = mrol_sphere_check_default();
    mrol_collisions places = mrol_collisions_default();
    motions.body = body, motions.configurations = configurations, motions.count = 3;
    answers.capacity = 2, answers.is_free = bits;
#define MOTIONS_FAIL(words) \
    FAILS(mrol_replica_check_motions(replica, &motions, &answers, NULL, &error), MROL_INVALID_ARGUMENT, words)
    MOTIONS_FAIL("check.count must be even");
    motions.motions = 2;
    MOTIONS_FAIL("check.lengths is NULL");
    motions.lengths = lengths;
    MOTIONS_FAIL("motions have at least 2 configurations");
    motions.motions = 1;
    MOTIONS_FAIL("motions have at least 2 configurations");
    motions.count = 2, motions.step_m = -1.0f;
    MOTIONS_FAIL("step_m must lie in");
    motions.step_m = 1.1e-5f;
    MOTIONS_FAIL("steps");
    motions.step_m = 0;
    MUST(mrol_replica_check_motions(replica, &motions, &answers, NULL, NULL) == MROL_OK && bits[0] == 0);
    check.spheres = spheres, check.count = 2;
    places.capacity = 2, places.colliding = bits;
#define SPHERES_FAIL(words) \
    FAILS(mrol_replica_check_spheres(replica, &check, &places, NULL, &error), MROL_INVALID_ARGUMENT, words)
    check.groups = 2;
    SPHERES_FAIL("check.sizes is NULL");
    check.sizes = sizes;
    SPHERES_FAIL("sizes are of 3 spheres in all, got 2");
    check.sizes = NULL, check.groups = 0, check.padding_m = NAN;
    SPHERES_FAIL("padding_m");
    check.padding_m = 0, spheres[3] = INFINITY;
    SPHERES_FAIL("spheres[0]");
    spheres[3] = 0.1f;
    MUST(mrol_replica_check_spheres(replica, &check, &places, NULL, NULL) == MROL_OK && bits[0] == 1);
}

static void bad_rays_points_and_grids(mrol_replica replica) {
    float points[6] = {0.05f, 2.0f, 0.05f, 0.05f, -2.0f, 0.05f}, directions[6] = {0, -1, 0, 0, 1, 0}, tops[3];
    uint8_t bits[1];
    mrol_ray_question rays = mrol_ray_question_default();
    mrol_ray_answers hits = mrol_ray_answers_default();
    mrol_nearest_question nearest = mrol_nearest_question_default();
    mrol_nearest_answers found = mrol_nearest_answers_default();
    mrol_grid_question grid = mrol_grid_question_default();
    mrol_grid_answers cells = mrol_grid_answers_default();
    mrol_grid_shape shape;
    rays.origins = points, rays.origins_count = 2, rays.directions = rays.ends = directions, rays.count = 2;
    hits.capacity = 2, hits.hit = bits;
#define RAYS_FAIL(words) FAILS(mrol_replica_cast_rays(replica, &rays, &hits, NULL, &error), MROL_INVALID_ARGUMENT, words)
    RAYS_FAIL("one of them must be NULL");
    rays.directions = NULL, rays.range_m = 1;
    RAYS_FAIL("question.range_m is of rays with directions");
    rays.ends = NULL;
    RAYS_FAIL("question.directions is NULL");
    rays.directions = directions, rays.range_m = -1;
    RAYS_FAIL("range_m must be above 0");
    rays.range_m = 0, rays.origins_count = 0;
    RAYS_FAIL("origins must be one, or one for each");
    rays.origins_count = 2, directions[1] = -2;
    RAYS_FAIL("directions[0]");
    directions[1] = -1;
    MUST(mrol_replica_cast_rays(replica, &rays, &hits, NULL, NULL) == MROL_OK && bits[0] == 3);
    nearest.points = points, nearest.count = 2, nearest.radius_m = 1;
    found.capacity = 2, found.found = bits, found.away = points + 1;
#define NEAREST_FAILS(words) \
    FAILS(mrol_replica_find_nearest(replica, &nearest, &found, NULL, &error), MROL_INVALID_ARGUMENT, words)
    NEAREST_FAILS("answers.away overlaps");
    found.away = NULL, nearest.to = 2;
    NEAREST_FAILS("question.to must be 0 or 1, got 2");
    nearest.to = 0, nearest.radius_m = NAN;
    NEAREST_FAILS("radius_m must lie above 0");
    nearest.radius_m = 1, points[0] = NAN;
    NEAREST_FAILS("points[0] is not finite");
    points[0] = 0.05f;
    MUST(mrol_replica_find_nearest(replica, &nearest, &found, NULL, NULL) == MROL_OK && bits[0] == 0);
    cells.capacity = 2, cells.tops_m = tops;
#define GRID_FAILS(words) \
    FAILS(mrol_replica_project_grid(replica, &grid, &cells, NULL, &error), MROL_INVALID_ARGUMENT, words)
    GRID_FAILS("answers.shape is NULL");
    cells.shape = &shape, grid.has_area = 2;
    GRID_FAILS("question.has_area must be 0 or 1");
    grid.has_area = 0, grid.band_from = 2;
    GRID_FAILS("question.band_from must be 0 or 1, got 2");
    grid.band_from = MROL_BAND_FROM_MAP, grid.cell_m = 0.15;
    GRID_FAILS("cell_m must be a whole number of voxels");
    grid.cell_m = 0;
    GRID_FAILS("answers.capacity must be at least 3, got 2");
    MUST(shape.cells[0] == 3 && shape.cells[1] == 1);
    cells.capacity = 3;
    MUST(mrol_replica_project_grid(replica, &grid, &cells, NULL, NULL) == MROL_OK);
    MUST(tops[0] > 0.099f && tops[2] < 0.101f && shape.origin_m[0] == 0);
}

/* A body is one until it is freed, and none from then on. */
static void bad_questions(mrol_replica replica) {
    float sphere[4] = {0, 0, 0, 0.1f};
    mrol_link link = ball(sphere);
    mrol_body body;
    mrol_pose_check check = mrol_pose_check_default();
    mrol_collisions places = mrol_collisions_default();
    bad_bodies();
    MUST(mrol_body_new(&link, 1, &body, NULL) == MROL_OK && body.number != 0);
    bad_checks(replica, body);
    bad_motions_and_spheres(replica, body);
    bad_rays_points_and_grids(replica);
    MUST(mrol_body_free(body, NULL) == MROL_OK);
    FAILS(mrol_body_free(body, &error), MROL_INVALID_ARGUMENT, "body is none");
    check.body = body;
    FAILS(mrol_replica_check_poses(replica, &check, &places, NULL, &error), MROL_INVALID_ARGUMENT, "body is none");
}

static void bad_replicas(mrol_replica replica) {
    mrol_replica_status status;
    mrol_map_version version;
    mrol_replica others[3];
    mrol_point_query query = mrol_point_query_default();
    size_t i;
    others[0] = NONE, others[1].number = replica.number + 1, others[2].number = UINT64_MAX;
    for (i = 0; i < 3; i++) {
        mrol_replica other = others[i];
        FAILS(mrol_replica_get_status(other, &status, &error), MROL_CLOSED, "not open");
        FAILS(mrol_replica_get_version(other, &version, &error), MROL_CLOSED, "not open");
        FAILS(mrol_replica_wait_for_revision(other, 0, 0, &error), MROL_CLOSED, "not open");
        FAILS(mrol_replica_check_age(other, 1000, &error), MROL_CLOSED, "not open");
        FAILS(mrol_replica_query_points(other, &query, NULL, 0, NULL, &error), MROL_CLOSED, "not open");
        FAILS(mrol_replica_close(other, &error), MROL_CLOSED, "not open");
        MUST(mrol_replica_revision(other) == 0);
    }
    FAILS(mrol_replica_get_status(replica, NULL, &error), MROL_INVALID_ARGUMENT, "status is NULL");
    FAILS(mrol_replica_get_version(replica, misaligned(&version), &error), MROL_INVALID_ARGUMENT, "version is at");
    FAILS(mrol_replica_wait_for_revision(replica, 2, 1, &error), MROL_TIMEOUT, "revision 2 did not come");
    MUST(mrol_replica_wait_for_revision(replica, 1, UINT64_MAX, NULL) == MROL_OK);
    FAILS(mrol_replica_check_age(replica, 0, &error), MROL_STALE, "age_max is 0ns");
    MUST(mrol_replica_check_age(replica, UINT64_MAX, NULL) == MROL_OK);
}

/* Damaged calls to a server change nothing, and a call that runs out of time ends. */
static void bad_calls(const char *address, const char *map) {
    const float point[3] = {1, 2, 3}, times[1] = {0};
    const double bad_pose[7] = {0, 0, 0, 0, 0, 0, 2}, nowhere[3] = {0, 0, 0}, pose[7] = {0, 0, 0, 0, 0, 0, 1};
    mrol_client client = {99}, none = {0};
    mrol_client_options good = mrol_client_options_default(), options;
    mrol_scan scan = mrol_scan_default(), wrong;
    mrol_scan_answer answer;
    mrol_localization localization = mrol_localization_default();
    mrol_localization_answer localized;
    mrol_point_query query = mrol_point_query_default();
    uint8_t bits = 0;
    good.address = address;
    FAILS(mrol_client_open(NULL, &client, &error), MROL_INVALID_ARGUMENT, "options is NULL");
    MUST(client.number == 0);
    FAILS(mrol_client_open(&good, NULL, &error), MROL_INVALID_ARGUMENT, "client is NULL");
    options = good, options.address = NULL;
    FAILS(mrol_client_open(&options, &client, &error), MROL_INVALID_ARGUMENT, "options.address is NULL");
    options = good, options.address = "http://127.0.0.1:1/?key=secret";
    FAILS(mrol_client_open(&options, &client, &error), MROL_INVALID_ARGUMENT, "what was given is not shown");
    options = good, options.struct_size = 8;
    FAILS(mrol_client_open(&options, &client, &error), MROL_INVALID_ARGUMENT, "struct_size must lie in");
    options = good, options.credentials.ca_file = "/nowhere";
    FAILS(mrol_client_open(&options, &client, &error), MROL_INVALID_ARGUMENT, "options.ca_file");
    options = good, options.credentials.private_key_file = "/proc/self/status";
    FAILS(mrol_client_open(&options, &client, &error), MROL_INVALID_ARGUMENT, "not both");
    MUST(mrol_client_open(&good, &client, NULL) == MROL_OK);

    scan.robot = "r", scan.xyz = point, scan.count = 1, scan.guess = pose, scan.at_guess = 1;
#define SCAN_FAILS(code, words) FAILS(mrol_client_align_scan(client, map, &wrong, &answer, &error), code, words)
    FAILS(mrol_client_insert_scan(none, map, &scan, &answer, &error), MROL_CLOSED, "not open");
    FAILS(mrol_client_insert_scan(client, NULL, &scan, &answer, &error), MROL_INVALID_ARGUMENT, "map is NULL");
    FAILS(mrol_client_insert_scan(client, "a b", &scan, &answer, &error), MROL_INVALID_ARGUMENT, "a b");
    FAILS(mrol_client_insert_scan(client, map, NULL, &answer, &error), MROL_INVALID_ARGUMENT, "scan is NULL");
    FAILS(mrol_client_insert_scan(client, map, &scan, NULL, &error), MROL_INVALID_ARGUMENT, "answer is NULL");
    FAILS(mrol_client_insert_scan(client, map, misaligned(&scan), &answer, &error), MROL_INVALID_ARGUMENT, "scan is at");
    wrong = scan, wrong.robot = NULL;
    SCAN_FAILS(MROL_INVALID_ARGUMENT, "scan.robot is NULL");
    wrong = scan, wrong.robot = "r 1";
    SCAN_FAILS(MROL_INVALID_ARGUMENT, "r 1");
    wrong = scan, wrong.session = "\n";
    SCAN_FAILS(MROL_INVALID_ARGUMENT, "session");
    wrong = scan, wrong.xyz = NULL;
    SCAN_FAILS(MROL_INVALID_ARGUMENT, "scan.xyz");
    wrong = scan, wrong.count = SIZE_MAX;
    SCAN_FAILS(MROL_INVALID_ARGUMENT, "scan.xyz");
    wrong = scan, wrong.guess = bad_pose;
    SCAN_FAILS(MROL_INVALID_ARGUMENT, "scan.guess");
    wrong = scan, wrong.motion = pose;
    SCAN_FAILS(MROL_INVALID_ARGUMENT, "a guess and a motion");
    wrong = scan, wrong.gravity = nowhere;
    SCAN_FAILS(MROL_INVALID_ARGUMENT, "scan.gravity");
    wrong = scan, wrong.at_guess = 2;
    SCAN_FAILS(MROL_INVALID_ARGUMENT, "scan.at_guess");
    wrong = scan, wrong.reserved[3] = 1;
    SCAN_FAILS(MROL_INVALID_ARGUMENT, "scan.reserved");
    wrong = scan, wrong.count = 0;
    SCAN_FAILS(MROL_REFUSED, "");
    wrong = scan, wrong.point_times_s = times;
    SCAN_FAILS(MROL_REFUSED, "timestamp");
    FAILS(mrol_client_align_scan(client, "nowhere", &scan, &answer, &error), MROL_REFUSED, "nowhere");

    FAILS(mrol_client_localize(client, map, &localization, &localized, &error), MROL_REFUSED, "");
    localization.xyz = point, localization.count = 1, localization.gravity = nowhere;
    FAILS(mrol_client_localize(client, map, &localization, &localized, &error), MROL_INVALID_ARGUMENT, "localization.gravity");
    query.xyz = point, query.count = 1;
    FAILS(mrol_client_query_points(client, map, &query, NULL, 1, NULL, &error), MROL_INVALID_ARGUMENT, "occupied");
    FAILS(mrol_client_query_points(client, map, &query, &bits, 0, NULL, &error), MROL_INVALID_ARGUMENT, "occupied");
    MUST(mrol_client_query_points(client, map, &query, &bits, 1, NULL, NULL) == MROL_OK);
    FAILS(mrol_client_create_map(client, "m", NAN, 3, &error), MROL_REFUSED, "resolution_m");
    FAILS(mrol_client_create_map(client, "m", 0.1, UINT32_MAX, &error), MROL_REFUSED, "levels");
    FAILS(mrol_client_rename_map(client, "nowhere", "m", &error), MROL_REFUSED, "nowhere");
    FAILS(mrol_client_rename_map(client, map, map, &error), MROL_REFUSED, map);
    FAILS(mrol_client_rename_map(client, NULL, "m", &error), MROL_INVALID_ARGUMENT, "map");
    FAILS(mrol_client_rename_map(client, map, NULL, &error), MROL_INVALID_ARGUMENT, "to");
    MUST(mrol_client_close(client, NULL) == MROL_OK);
    FAILS(mrol_client_close(client, &error), MROL_CLOSED, "not open");
    FAILS(mrol_client_align_scan(client, map, &scan, &answer, &error), MROL_CLOSED, "not open");
}

/* In a child nothing hangs, and nothing is answered. */
static void a_child_is_refused(const mrol_replica_options *options, mrol_replica replica) {
    int status = 0;
    pid_t child = fork();
    MUST(child >= 0);
    if (child == 0) {
        mrol_replica own;
        mrol_body body = {1};
        mrol_point_query query = mrol_point_query_default();
        FAILS(mrol_replica_query_points(replica, &query, NULL, 0, NULL, &error), MROL_FORKED, "forked");
        FAILS(mrol_replica_wait_for_revision(replica, 9, 9, &error), MROL_FORKED, "forked");
        FAILS(mrol_replica_open(options, &own, &error), MROL_FORKED, "forked");
        FAILS(mrol_body_new(NULL, 0, &body, &error), MROL_FORKED, "forked");
        FAILS(mrol_body_free(body, &error), MROL_FORKED, "forked");
        FAILS(mrol_replica_close(replica, &error), MROL_FORKED, "forked");
        {
            mrol_client client = {1};
            mrol_client_options calling = mrol_client_options_default();
            calling.address = options->address;
            FAILS(mrol_client_open(&calling, &client, &error), MROL_FORKED, "forked");
            client.number = 1;
            FAILS(mrol_client_close(client, &error), MROL_FORKED, "forked");
        }
        _exit(0);
    }
    MUST(waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

int main(int count, char **words) {
    mrol_replica replica;
    mrol_replica_options options;
    MUST(count == 3);
    MUST(mrol_abi_version() == MROL_ABI_VERSION && mrol_library_version()[0] != 0);
    MUST(strcmp(mrol_code_name(MROL_TIMEOUT), "MROL_TIMEOUT") == 0);
    MUST(strcmp(mrol_code_name(-7), "MROL_UNKNOWN") == 0);
    bad_options(words[1], words[2]);
    options = options_for(words[1], words[2]);
    MUST(mrol_replica_open(&options, &replica, NULL) == MROL_OK);
    bad_queries(replica);
    bad_questions(replica);
    bad_replicas(replica);
    bad_calls(words[1], words[2]);
    a_child_is_refused(&options, replica);
    MUST(mrol_replica_revision(replica) == 1);
    MUST(mrol_replica_close(replica, NULL) == MROL_OK);
    MUST(mrol_replica_close(replica, NULL) == MROL_CLOSED);
    printf("ok\n");
    return 0;
}
