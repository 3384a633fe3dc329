/* A replica of an mrol map, in this process: a copy that follows the server's map and answers without a call. And a client: scans
 * that go to the server, and questions that it answers (mrol_client_open and its like).
 *
 *     mrol_replica_options options = mrol_replica_options_default();
 *     options.address = "http://127.0.0.1:7334";
 *     options.map = "demo";
 *     mrol_replica replica;
 *     mrol_error error;
 *     if (mrol_replica_open(&options, &replica, &error) != MROL_OK) {
 *         fprintf(stderr, "%s\n", error.message);
 *     }
 *
 * Link with -lmrol_replica (README.md has the libraries that the static one needs). C99 or newer, C++11 or newer.
 *
 * Every function of this form
 *
 *     mrol_code mrol_replica_...(mrol_replica replica, const <question> *question, <outputs>, mrol_error *error);
 *
 * returns MROL_OK, or a code with its reason in `error`. Questions of planners (mrol_replica_check_motions and its like) answer
 * into arrays of the caller, which a struct of places names. After an error no output but `error` has been written, unless the
 * function says otherwise. No function calls back, prints, exits, or lets an exception or a panic out.
 *
 * UNITS. Meters, in the map's frame. A pose is seven numbers: x y z, and a unit quaternion qx qy qz qw (within 0.001).
 *
 * OWNERSHIP. All memory is the caller's. The library reads what a pointer points to during the call alone and keeps no
 * pointer; it returns none that must be freed. Strings that it returns are constants.
 *
 * THREADS. Every function may be called from any thread at any time, on the same replica too. Questions of several threads run
 * beside each other. A question waits for a change that is being applied to the copy, about a millisecond. Memory that is
 * passed in must not be written by another thread meanwhile.
 *
 * BODIES. A body, mrol_body, is made once and asked about as often as a planner likes, of every replica, from every thread: a
 * question about it copies nothing of it. It is a number as a replica is: freed (mrol_body_free) it is an error for ever, and
 * questions under way are answered. No replica needs to be open for it.
 *
 * LIFETIME. A replica is a number, not a pointer: it lives from mrol_replica_open to mrol_replica_close. Using one after that
 * is MROL_CLOSED, closing one twice as well, and no other replica gets its number. Closing one that other threads use is fine:
 * questions under way are answered, waits end with MROL_CLOSED. All replicas of a process share one thread for the network and
 * at most two that apply changes; they end with the last replica. The library may be unloaded (dlclose) when all replicas are closed
 * and every call has returned.
 *
 * FORK. Replicas and bodies stay with the process that made them. A child of fork() gets MROL_FORKED from each function that
 * takes or makes one; it may exec. Fork before the first mrol_replica_open and mrol_body_new if a child is to make some of its own.
 *
 * CLIENTS. What is said of replicas here holds of connections, mrol_client, too.
 *
 * SEVERAL SERVERS. An address may be a list, "http://node-1:7334,http://node-2:7334", of servers of the same maps. The first that
 * answers is used until it is gone, then the next. A question is asked again there, and so is a scan with a scan_id; a change
 * without an id is sent again only if it was not sent before, and ends with MROL_UNREACHABLE otherwise: it may have been made.
 * All of it counts to the timeout of the call. Point queries wait for the last revision that any of the servers has told, so that
 * the map never goes back.
 *
 * SIGNALS. No function is safe in a signal handler.
 */
#ifndef MROL_H
#define MROL_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of this interface. A library is of use to programs that were compiled against the same one. From 2 on keep-outs count:
 * a library of version 1 knows none, and says free where they are. From 3 on a localization tells `agreement`, in place of
 * `fit`. */
#define MROL_ABI_VERSION 3

/* Bytes of a reason and of a message with their terminating zero. */
#define MROL_REASON_BYTES 48
#define MROL_MESSAGE_BYTES 464

/* Most points of one query, and elements of any other array. */
#define MROL_POINTS_MAX ((size_t)1 << 27)

/* Most links of a body. */
#define MROL_LINKS_MAX 4096

/* Stands for no link in answers. */
#define MROL_NO_LINK UINT32_MAX

/* Bytes of a bitmap of `count` answers: answer i is bit i % 8 (lowest first) of byte i / 8. */
#define MROL_BITMAP_BYTES(count) ((count) / 8 + ((count) % 8 != 0))

/* What became of a call. */
typedef int32_t mrol_code;
enum {
    /* It succeeded. */
    MROL_OK = 0,
    /* An argument is wrong, which the message names with its value and its limit. */
    MROL_INVALID_ARGUMENT = 1,
    /* The replica is not open: it never was, or is closed. */
    MROL_CLOSED = 2,
    /* The replica belongs to the process that forked this one. */
    MROL_FORKED = 3,
    /* No server answers, the connection broke, or server and client do not trust each other. */
    MROL_UNREACHABLE = 4,
    /* The server refused; `reason` is its word: map_not_found, permission_denied, ... */
    MROL_REFUSED = 5,
    /* It did not come in the time that was given. */
    MROL_TIMEOUT = 6,
    /* The map has more blocks than the options allow. */
    MROL_TOO_LARGE = 7,
    /* What the server sent makes no sense: another program, or another version. */
    MROL_DAMAGED = 8,
    /* A defect of this library, or the system has no thread for it. */
    MROL_INTERNAL = 9,
    /* The server was heard longer ago than age_max_ms allows; `reason` is replica_stale. */
    MROL_STALE = 10
};

/* Why a call failed. Every function takes NULL in its place. It is written on failure alone. */
typedef struct mrol_error {
    mrol_code code;
    /* Not used: zero. */
    uint32_t reserved;
    /* The reason as a word for programs: point_out_of_range, map_not_found, ...; empty where there is none. */
    char reason[MROL_REASON_BYTES];
    /* A sentence for people, UTF-8, cut off where it is longer. */
    char message[MROL_MESSAGE_BYTES];
} mrol_error;

/* An open replica. {0} is none. */
typedef struct mrol_replica {
    uint64_t number;
} mrol_replica;

/* A state of a map. */
typedef struct mrol_map_version {
    /* The map: one that is deleted and made again has another uuid. Bytes in the order in which they are written. */
    uint8_t map_uuid[16];
    /* Number of its last change. */
    uint64_t revision;
    /* Hash of what the map holds at this revision, equal to the one that the server tells; 0 without. */
    uint64_t content_hash;
    /* 1 with a content hash; 0 of a replica of a region, which does not know the map's. */
    uint8_t has_content_hash;
    /* Not used: zero. */
    uint8_t reserved[7];
} mrol_map_version;

/* What to copy, and from where. Take it from mrol_replica_options_default() and set address and map at least: zero, NULL
 * and 0 stand for the default everywhere. Nothing in it is kept after mrol_replica_open returns. */
typedef struct mrol_replica_options {
    /* sizeof(mrol_replica_options) where the program was compiled. */
    size_t struct_size;
    /* gRPC address of the server: "http://127.0.0.1:7334", "https://robot-7:7334" or "unix:/run/mrol/grpc.sock". One with a
     * user, a path or a query is refused: errors show the address, and a key in it would be in them. Several with commas
     * between them are servers of the same maps: see SEVERAL SERVERS. */
    const char *address;
    /* Name of the map. */
    const char *map;
    /* Secret of the caller's key; NULL where the server asks for none. */
    const char *key;
    /* Path of a PEM file: the server's certificate must be signed by one of these. NULL: by one that the system trusts. */
    const char *ca_file;
    /* Paths of PEM files: the certificate that the client shows with its signers, and its private key; both or neither. */
    const char *certificate_file;
    const char *private_key_file;
    /* Longest time until the copy is complete, milliseconds; 0: 60,000. */
    uint64_t open_timeout_ms;
    /* How long the server may be silent until the connection counts as lost, milliseconds: more than its
     * limits.watch_heartbeat_s. 0: 35,000. */
    uint64_t silence_timeout_ms;
    /* Most blocks of 8 x 8 x 8 finest voxels that the copy may have; 0: 16,777,216. */
    uint64_t blocks_max;
    /* The part of the map that is copied, where has_region is 1: voxels whose centers lie in the closed box, meters, in the
     * map's frame. Infinite sides are fine. */
    double region_min_m[3];
    double region_max_m[3];
    uint8_t has_region;
    /* 1: the copy has Bloom filters, for MROL_LOOKUP_BLOOM. 0: it has none, and MROL_LOOKUP_BLOOM is answered by the exact
     * set. */
    uint8_t with_filter;
    /* 1: the copy has no viewpoints, and does not know what is free. 0: it has them, some kilobytes for each place that scans
     * saw something new from. */
    uint8_t without_viewpoints;
    /* Not used: zero. */
    uint8_t reserved[5];
    /* How long ago the server may have been heard last for questions to be answered, milliseconds: more than its
     * limits.watch_heartbeat_s. Questions to an older copy end with MROL_STALE. 0: answers may be of any age, which
     * mrol_replica_get_status tells. */
    uint64_t age_max_ms;
} mrol_replica_options;

/* Which structure of a level answers. */
typedef int32_t mrol_lookup;
enum {
    /* The exact set. */
    MROL_LOOKUP_EXACT = 0,
    /* The Bloom filter: now and then "occupied" of a free voxel, never "free" of an occupied one. */
    MROL_LOOKUP_BLOOM = 1
};

/* A question about points: are their voxels occupied? Take it from mrol_point_query_default(). */
typedef struct mrol_point_query {
    /* sizeof(mrol_point_query) where the program was compiled. */
    size_t struct_size;
    /* `count` points: x y z each, meters. May be NULL where count is 0. */
    const float *xyz;
    /* At most MROL_POINTS_MAX. */
    size_t count;
    /* The pose that places the points in the map: 7 numbers, x y z in meters and a unit quaternion qx qy qz qw (within
     * 0.001). NULL: the points are in the map's frame. */
    const double *map_from_points;
    /* Level of the voxels: 0 is the finest, level n is 2^n as wide. */
    uint32_t level;
    mrol_lookup lookup;
    /* 1: points in keep-outs of the map count as occupied. */
    uint8_t keep_out;
    /* Not used: zero. */
    uint8_t reserved[7];
} mrol_point_query;

/* What all answers have, whatever was asked: all of one answer is of one revision. Where a server took long for a question of a
 * planner and let others go first meanwhile, it is of this revision or of later ones. */
typedef struct mrol_answer {
    /* The state of the map that was asked. */
    mrol_map_version version;
    /* How many were asked about: points here. */
    uint64_t asked;
    /* For how many of them the answer is yes: the points that are occupied. */
    uint64_t positive;
    /* Not used: zero. */
    uint64_t reserved[4];
} mrol_answer;

/* Bytes of the name of a keep-out with its terminating zero. */
#define MROL_NAME_BYTES 72

/* The name of a keep-out, with zeros behind it; all zeros where there is none. */
typedef struct mrol_name {
    char text[MROL_NAME_BYTES];
} mrol_name;

/* A body. {0} is none. */
typedef struct mrol_body {
    uint64_t number;
} mrol_body;

/* A rigid part of a body, in a frame of its own. A sphere meets a voxel where the closed ball and the closed cube share a
 * point, and a keep-out where it is no further from the center than the radius. {0} is a link of nothing. */
typedef struct mrol_link {
    /* `spheres_count` spheres: center x y z and radius each; at most 1000 m, and 512 voxels of the level that is asked. */
    const float *spheres;
    size_t spheres_count;
    /* `points_count` points: x y z each. A point meets the voxel that it falls in; with padding it is a sphere. */
    const float *points;
    size_t points_count;
    /* What is added to the radii of spheres and points. */
    float padding_m;
    /* Not used: zero. */
    uint32_t reserved[3];
} mrol_link;

/* What a region is. */
typedef int32_t mrol_region_kind;
enum {
    /* numbers: smallest x y z, largest x y z. */
    MROL_REGION_BOX = 1,
    /* numbers: center x y z, radius. */
    MROL_REGION_BALL = 2,
    /* numbers: pose of its center (7), sides along its own axes (3). */
    MROL_REGION_ORIENTED_BOX = 3
};

/* A part of space; borders belong to it. Numbers that its kind does not use are zero. */
typedef struct mrol_region {
    mrol_region_kind kind;
    /* Not used: zero. */
    uint32_t reserved;
    double numbers[10];
} mrol_region;

/* What all questions have in common. All zero: level 0, and keep-outs count as voxels do. */
typedef struct mrol_scope {
    /* Level of the voxels: 0 is the finest. */
    uint32_t level;
    /* 1: keep-outs of the map do not count. */
    uint8_t ignore_keep_outs;
    /* Not used: zero. */
    uint8_t reserved[3];
} mrol_scope;

/* A question: does a body fit at these configurations? Take it from mrol_pose_check_default(). */
typedef struct mrol_pose_check {
    /* sizeof(mrol_pose_check) where the program was compiled; so in all structs that begin with it. */
    size_t struct_size;
    mrol_scope scope;
    mrol_body body;
    /* `count` configurations: a pose for each link of the body, in the order of links. */
    const float *configurations;
    size_t count;
    /* Voxels whose centers lie in one of these do not count: an object that is grasped, the robot's own place. */
    const mrol_region *ignored;
    size_t ignored_count;
    /* Up to where clearances are told, at most 64 voxels of the level, which 0 stands for. */
    float clearance_max_m;
    /* 1: a voxel counts unless it is free: seen through by a scan, and not occupied. Costs more. */
    uint8_t unknown_is_occupied;
    /* Not used: zero. */
    uint8_t reserved[3];
} mrol_pose_check;

/* A question: do these spheres meet anything? Take it from mrol_sphere_check_default(). */
typedef struct mrol_sphere_check {
    size_t struct_size;
    mrol_scope scope;
    /* `count` spheres in the map's frame: center x y z and radius each. */
    const float *spheres;
    size_t count;
    /* How many spheres each of `groups` groups has; a group is answered as one. NULL and 0: each sphere by itself. */
    const uint32_t *sizes;
    size_t groups;
    const mrol_region *ignored;
    size_t ignored_count;
    /* What is added to all radii. */
    float padding_m;
    /* As in mrol_pose_check. */
    float clearance_max_m;
    /* As in mrol_pose_check. */
    uint8_t unknown_is_occupied;
    /* Not used: zero. */
    uint8_t reserved[7];
} mrol_sphere_check;

/* Where the answers to checks of poses and spheres go. What is NULL is not wanted; places for hits and for clearances are not
 * given both. Bits alone take the least time. Take it from mrol_collisions_default(). */
typedef struct mrol_collisions {
    size_t struct_size;
    /* Elements that each array has room for: at least one for each configuration or group. */
    size_t capacity;
    /* A bit each, MROL_BITMAP_BYTES(count) bytes: it meets something. */
    uint8_t *colliding;
    /* What each meets first: the link (0 of spheres), in the order of links; MROL_NO_LINK where nothing is met. */
    uint32_t *hit_links;
    /* The sphere in the link or the group, or after all spheres of the link the point; 0 where nothing is met. */
    uint32_t *hit_parts;
    /* The voxel, see mrol_voxel_index: for a sphere the nearest to its center; 0 where nothing is met. */
    uint64_t *hit_voxels;
    /* The distance to the nearest voxel, 0 where one is met, at most clearance_max_m. */
    float *clearances_m;
    /* The link that is nearest; MROL_NO_LINK where nothing is nearer than clearance_max_m. */
    uint32_t *nearest_links;
    /* The keep-out that is met first, where it is met instead of a voxel. */
    mrol_name *hit_keep_outs;
} mrol_collisions;

/* A question: can a body move along these configurations? Between two of them a link's translation goes along a line, its
 * rotation along the shorter arc. Of the two arcs of half a turn the signs of the quaternions decide: x y z w and -x -y -z -w are
 * one pose, but lead there by different ways; whoever turns a link by 180 degrees gives a configuration between. Take it from
 * mrol_motion_check_default(). */
typedef struct mrol_motion_check {
    size_t struct_size;
    mrol_scope scope;
    mrol_body body;
    /* `count` configurations of all motions, one motion after the other. */
    const float *configurations;
    size_t count;
    /* How many configurations each of `motions` motions has, two or more. NULL and 0: two each. */
    const uint32_t *lengths;
    size_t motions;
    const mrol_region *ignored;
    size_t ignored_count;
    /* How far a point of the body moves from one check for voxels to the next, at most. 0: half a voxel of the level. Keep-outs,
     * which may be thinner, are met along the whole way, to within X: 1 mm, half a voxel of level 0, or the step, whichever is
     * least, at every level. Nothing enters a keep-out by more than half of X unnoticed, and what is no larger than that goes
     * through none, however thin. */
    float step_m;
    /* As in mrol_pose_check. */
    float clearance_max_m;
    /* As in mrol_pose_check. */
    uint8_t unknown_is_occupied;
    /* Not used: zero. */
    uint8_t reserved[7];
} mrol_motion_check;

/* Where the answers to checks of motions go; NULL: not wanted. Take it from mrol_motion_answers_default(). */
typedef struct mrol_motion_answers {
    size_t struct_size;
    /* Elements that each array has room for: at least one for each motion. */
    size_t capacity;
    /* A bit each: the body meets nothing on its way. */
    uint8_t *is_free;
    /* The first check at which the body meets a voxel, or where it meets a keep-out (at most X late), as a share of the motion:
     * configuration i of n is i / (n - 1). NaN of a motion that is free. */
    float *first_hits;
    /* The least distance to a voxel at any check, and to a keep-out along the way: too much by a sixteenth of it (and no more
     * than half a step) or by half of X, whichever is more. 0 where one is met. Costs more than the bit. */
    float *clearances_m;
} mrol_motion_answers;

/* A question: what do these rays meet? What a ray would enter just where it ends is not met, voxel or keep-out. Take it from mrol_ray_question_default(). */
typedef struct mrol_ray_question {
    size_t struct_size;
    mrol_scope scope;
    /* Where rays begin: one point for all of them, or one each. */
    const float *origins;
    size_t origins_count;
    /* `count` rays. One of the two: unit vectors (within 0.001) ... */
    const float *directions;
    /* ... or points where the rays end. The other is NULL. */
    const float *ends;
    size_t count;
    /* Length of rays with directions; 0: as far as the map goes. */
    double range_m;
    /* As in mrol_pose_check. */
    uint8_t unknown_is_occupied;
    /* Not used: zero. */
    uint8_t reserved[7];
} mrol_ray_question;

/* Where the answers about rays go; NULL: not wanted. Take it from mrol_ray_answers_default(). */
typedef struct mrol_ray_answers {
    size_t struct_size;
    /* Elements that each array has room for: at least one for each ray. */
    size_t capacity;
    /* A bit each: it meets something. */
    uint8_t *hit;
    /* From the origin to where it enters the voxel: 0 where it begins in it, infinite where it meets nothing; or a keep-out. */
    float *distances_m;
    /* The voxel, see mrol_voxel_index; 0 where it meets none. */
    uint64_t *voxels;
    /* The keep-out that it meets instead of a voxel. */
    mrol_name *keep_outs;
} mrol_ray_answers;

/* What of a voxel a distance is measured to; to keep-outs it is measured to their borders. */
typedef int32_t mrol_measured_to;
enum {
    /* The nearest place of its cube: 0 for a point in it. */
    MROL_MEASURED_TO_CUBES = 0,
    /* Its center. */
    MROL_MEASURED_TO_CENTERS = 1
};

/* A question: what is nearest to these points? Take it from mrol_nearest_question_default(), and set radius_m. */
typedef struct mrol_nearest_question {
    size_t struct_size;
    mrol_scope scope;
    const float *points;
    size_t count;
    /* How far to look: above 0, at most 64 voxels of the level. */
    double radius_m;
    mrol_measured_to to;
    /* Not used: zero. */
    uint8_t reserved[4];
} mrol_nearest_question;

/* Where the answers about points go; NULL: not wanted. Take it from mrol_nearest_answers_default(). */
typedef struct mrol_nearest_answers {
    size_t struct_size;
    /* Elements that each array has room for: at least one for each point. */
    size_t capacity;
    /* A bit each: something is within the radius. */
    uint8_t *found;
    /* The distance to it; infinite where nothing is. */
    float *distances_m;
    /* The voxel, see mrol_voxel_index; 0 where there is none. Of those equally far the one with the smallest number. */
    uint64_t *voxels;
    /* Three numbers each: the unit vector away from it; zero where the distance is, and where nothing is. */
    float *away;
    /* The keep-out, where one is nearer than all voxels. */
    mrol_name *keep_outs;
} mrol_nearest_answers;

/* A question: what is known of these points? Take it from mrol_classify_question_default(). */
typedef struct mrol_classify_question {
    size_t struct_size;
    mrol_scope scope;
    const float *points;
    size_t count;
} mrol_classify_question;

/* Where the answers about points go; NULL: not wanted. A point that is neither occupied nor free is unknown. Take it from
 * mrol_classify_answers_default(). */
typedef struct mrol_classify_answers {
    size_t struct_size;
    /* Elements that each array has room for: at least one for each point. */
    size_t capacity;
    /* A bit each: its voxel is occupied, or the point lies in a keep-out. */
    uint8_t *is_occupied;
    /* A bit each: a scan saw through the center of its voxel, and it is not occupied. */
    uint8_t *is_free;
} mrol_classify_answers;

/* A question: where does free space end, with nothing known beyond? Take it from mrol_frontier_question_default(), and set the
 * box. */
typedef struct mrol_frontier_question {
    size_t struct_size;
    mrol_scope scope;
    /* Smallest and largest x y z of the box that is looked into, at most 4,000,000 voxels. */
    double min_m[3];
    double max_m[3];
    /* How far from its middle a frontier is looked at: at most 256 voxels of the level. 0: 20 voxels. */
    double standoff_m;
    /* Least number of voxels of a frontier. 0: 8. */
    uint64_t size_min;
} mrol_frontier_question;

/* Free voxels that hang together, each beside an unknown one. */
typedef struct mrol_frontier {
    uint64_t voxels;
    /* The mean of their centers, and the box that holds them. */
    double center_m[3];
    double min_m[3];
    double max_m[3];
    /* Where has_view is 1: a place from which a line to target_m runs through free voxels alone, and the way it looks: x forward,
     * y to the left and level, as the quaternion x y z w and as angles. */
    double view_m[3];
    double view_rotation[4];
    double target_m[3];
    double yaw_rad;
    double elevation_rad;
    uint8_t has_view;
    /* Not used: zero. */
    uint8_t reserved[7];
} mrol_frontier;

/* Where frontiers go, the largest first. Take it from mrol_frontier_answers_default(). */
typedef struct mrol_frontier_answers {
    size_t struct_size;
    /* Frontiers that there is room for, at most 1,000: no more are told. */
    size_t capacity;
    /* NULL: not wanted. */
    mrol_frontier *frontiers;
} mrol_frontier_answers;

/* What the heights of a grid's band count from. */
enum {
    /* The floor that robots stand on, in each column of voxels: found below the viewpoints of the map. A replica has them unless
     * its options say otherwise; one of a region cannot tell the floor. Without bounds it does not matter. */
    MROL_BAND_FROM_FLOOR = 0,
    /* z = 0 of the map, where usually the first scan's sensor was. */
    MROL_BAND_FROM_MAP = 1
};

/* A question: what is the map, seen from above? Take it from mrol_grid_question_default(). */
typedef struct mrol_grid_question {
    size_t struct_size;
    mrol_scope scope;
    /* Smallest and largest x and y, where has_area is 1; otherwise all that is there. Cells lie at whole multiples of their
     * side, and every cell that the area meets belongs to the grid. */
    double area_min_m[2];
    double area_max_m[2];
    /* Voxels count that reach between these heights above what band_from says, by more than a border, where has_min_z and
     * has_max_z are 1; where both lie in one voxel, that one. */
    double min_z_m;
    double max_z_m;
    /* Side of a cell: a whole number of the level's voxels. 0: one voxel. */
    double cell_m;
    uint8_t has_area;
    uint8_t has_min_z;
    uint8_t has_max_z;
    /* 1: tell free cells from unknown ones. Takes more time. */
    uint8_t tell_unknown;
    /* MROL_BAND_FROM_FLOOR or MROL_BAND_FROM_MAP. */
    uint8_t band_from;
    /* Not used: zero. */
    uint8_t reserved[3];
} mrol_grid_question;

/* How large a grid is: cell (x, y) has the number y * cells[0] + x. */
typedef struct mrol_grid_shape {
    double cell_m;
    /* Corner of the grid: smallest x and y. */
    double origin_m[2];
    /* Cells along x and y. */
    uint64_t cells[2];
    /* The lowest and the highest floor of these cells, in the map frame; NaN where the band does not count from the floor, or it
     * reaches none of them. */
    double floor_min_m;
    double floor_max_m;
} mrol_grid_shape;

/* Where a grid goes. Take it from mrol_grid_answers_default(), and set shape. */
typedef struct mrol_grid_answers {
    size_t struct_size;
    /* Cells that each array has room for. */
    size_t capacity;
    /* How large the grid is: written too where the capacity is too small for it. */
    mrol_grid_shape *shape;
    /* A bit a cell: it has a voxel in the band, or a point of a keep-out; NULL: not wanted. */
    uint8_t *occupied;
    /* Height in the map frame of the top of each cell's highest voxel in the band, NaN of a cell without one, for keep-outs have none;
     * NULL: not wanted. */
    float *tops_m;
    /* A bit a cell: it is not occupied, and each of its columns of voxels has a free one in the band. What is neither occupied nor
     * free is unknown. For questions with tell_unknown; NULL: not wanted. */
    uint8_t *is_free;
} mrol_grid_answers;

/* How far a replica is. */
typedef struct mrol_replica_status {
    /* The state of the copy. */
    mrol_map_version version;
    /* The newest revision that the server told of: the copy lags as far behind it. */
    uint64_t head_revision;
    /* How often the whole map was copied: 1 after opening. */
    uint64_t resets;
    /* 1 while the server is telling of changes. */
    uint8_t is_connected;
    /* 1 once the replica follows no longer, since the server refused its key several times in a row: the copy stays as it is, and
     * grows old. */
    uint8_t has_ended;
    /* Not used: zero. */
    uint8_t reserved[2];
    /* How long ago the server was heard last, milliseconds, at most UINT32_MAX: a server that is there says something at least every
     * limits.watch_heartbeat_s, so that an older copy may lack changes, even while is_connected is 1. */
    uint32_t age_ms;
    /* Why the connection was lost last, UTF-8; empty while it stands. */
    char last_error[MROL_MESSAGE_BYTES];
} mrol_replica_status;

/* A connection to a server. {0} is none. */
typedef struct mrol_client {
    uint64_t number;
} mrol_client;

/* What a server wants to see, and what it is trusted by; NULL: nothing, or what the system trusts. */
typedef struct mrol_credentials {
    /* Secret of the caller's key. */
    const char *key;
    /* Path of a PEM file: the server's certificate must be signed by one of these. */
    const char *ca_file;
    /* Paths of PEM files: the certificate that the client shows with its signers, and its private key; both or neither. */
    const char *certificate_file;
    const char *private_key_file;
} mrol_credentials;

/* Whom to ask. Take it from mrol_client_options_default() and set the address at least. Nothing in it is kept after
 * mrol_client_open returns. */
typedef struct mrol_client_options {
    size_t struct_size;
    /* gRPC address of the server, as in mrol_replica_options. */
    const char *address;
    mrol_credentials credentials;
    /* Longest time of a call, milliseconds; 0: 30,000. */
    uint64_t timeout_ms;
} mrol_client_options;

/* A scan, as a robot sends it. Take it from mrol_scan_default(). */
typedef struct mrol_scan {
    size_t struct_size;
    /* Name of the robot: each has one of its own. */
    const char *robot;
    /* Name of this run of the robot's software, in which scan ids are unique; NULL: the empty one. */
    const char *session;
    /* With has_scan_id: the robot's own number of the scan. A scan that is sent again under it is in the map once, so that a call
     * which ended with MROL_TIMEOUT or MROL_UNREACHABLE may be repeated. */
    uint64_t scan_id;
    /* `count` points in the sensor frame: x y z each, meters; NaN and infinity mean "no return". */
    const float *xyz;
    size_t count;
    /* Where it is thought to have been taken (7 numbers, map_from_sensor), or how far from the robot's last accepted pose
     * (last_from_sensor). Both NULL: at that pose. */
    const double *guess;
    const double *motion;
    /* The direction in which things fall, in the sensor frame: 3 numbers of any length; NULL: not known. */
    const double *gravity;
    /* With has_timestamp: when it was taken, nanoseconds since 1970. */
    int64_t timestamp_ns;
    /* When each point was measured, seconds from the timestamp, `count` of them: the scan is deskewed. NULL: all at once. */
    const float *point_times_s;
    uint8_t has_scan_id;
    uint8_t has_timestamp;
    /* 1: it is added at its guess, not aligned. */
    uint8_t at_guess;
    /* 1: it is added where it was found even if it does not fit. */
    uint8_t force;
    /* Not used: zero. */
    uint8_t reserved[4];
} mrol_scan;

/* What became of a scan, or would have. One that does not fit is an answer, and the map is as it was. */
typedef struct mrol_scan_answer {
    mrol_map_version version;
    /* Where it was found: x y z qx qy qz qw. */
    double map_from_sensor[7];
    /* The share of its points in occupied voxels of level 0, before it is added. */
    double overlap;
    /* With has_information: the inverse covariance of the pose, row by row: x y z in meters, then turns in radians. */
    double information[36];
    uint64_t new_voxels;
    uint64_t carved_voxels;
    uint64_t points_skipped;
    /* 1: it fits, and was added or would be. */
    uint8_t is_accepted;
    /* 1: it was accepted before under its id, and this is that answer. */
    uint8_t is_replayed;
    /* 1: the robot stands and sees nothing new: accepted, and not kept. */
    uint8_t is_stationary;
    uint8_t has_information;
    /* Not used: zero. */
    uint8_t reserved[4];
    /* accepted, low_overlap, undetermined, ambiguous or contradicted. */
    char verdict[MROL_REASON_BYTES];
    /* Why, in a sentence with figures, UTF-8. */
    char reason[MROL_MESSAGE_BYTES];
} mrol_scan_answer;

/* A question: where was this scan taken? Take it from mrol_localization_default(). */
typedef struct mrol_localization {
    size_t struct_size;
    /* `count` points in the sensor frame: x y z each, meters. */
    const float *xyz;
    size_t count;
    /* As in mrol_scan, good to 2 degrees: with it the search is about ten times as fast. */
    const double *gravity;
    /* When to answer with the best so far, milliseconds; 0: 10,000. Open the client with a longer timeout_ms. */
    uint64_t time_limit_ms;
    /* The same seed gives the same answer. */
    uint64_t seed;
} mrol_localization;

/* Where a scan was taken. One that fits nowhere, or in several places, is an answer. */
typedef struct mrol_localization_answer {
    /* The best place: x y z qx qy qz qw; the identity where there is none. */
    double map_from_sensor[7];
    double overlap;
    /* The share of rays that agree there, of those of which anything is known: of the scan's or of earlier scans', where
     * it is smaller. 0 where nothing is known. */
    double agreement;
    /* How many places were found. */
    uint64_t candidates;
    /* 1: rays believe the best place, and no other is as likely. */
    uint8_t is_accepted;
    /* 1: the time was up. */
    uint8_t is_cut_short;
    /* Not used: zero. */
    uint8_t reserved[6];
    char verdict[MROL_REASON_BYTES];
    char reason[MROL_MESSAGE_BYTES];
} mrol_localization_answer;

/* Version of the library, "0.2.0", and of the interface that it has: MROL_ABI_VERSION of its own header. */
const char *mrol_library_version(void);
uint32_t mrol_abi_version(void);

/* The name of a code: "MROL_TIMEOUT"; "MROL_UNKNOWN" of a number that is none. */
const char *mrol_code_name(mrol_code code);

/* Copies a map and follows it from then on; returns when the copy is complete. `replica` is set to none on failure.
 *
 * Where the connection breaks the replica comes back by itself and goes on from its last revision; meanwhile it answers as
 * it is, up to options.age_max_ms. A server that refuses the key several times in a row is not asked again: see has_ended of
 * mrol_replica_status. Where the server goes on from an older data folder than the copy was made of, all is copied again. The
 * system's look-up of a host's name is waited for, also beyond the time-out.
 *
 * Errors: MROL_INVALID_ARGUMENT, MROL_UNREACHABLE, MROL_REFUSED, MROL_TIMEOUT, MROL_TOO_LARGE, MROL_DAMAGED. */
mrol_code mrol_replica_open(const mrol_replica_options *options, mrol_replica *replica, mrol_error *error);

/* Ends a replica and frees its memory, once questions under way are answered. Errors: MROL_CLOSED where it is closed already,
 * which does no harm. */
mrol_code mrol_replica_close(mrol_replica replica, mrol_error *error);

/* How far the replica is. */
mrol_code mrol_replica_get_status(mrol_replica replica, mrol_replica_status *status, mrol_error *error);

/* Revision, uuid and content hash of the copy. */
mrol_code mrol_replica_get_version(mrol_replica replica, mrol_map_version *version, mrol_error *error);

/* The copy's revision; 0 of a replica that is not open too. */
uint64_t mrol_replica_revision(mrol_replica replica);

/* Waits until the copy has `revision` of the map that it copies now, for instance one that an insertion returned. Errors:
 * MROL_TIMEOUT where it does not come within `timeout_ms`; MROL_CLOSED where the replica is closed meanwhile. */
mrol_code mrol_replica_wait_for_revision(mrol_replica replica, uint64_t revision, uint64_t timeout_ms, mrol_error *error);

/* Refuses a copy whose server was heard longer ago than `age_max_ms`, before a question whose answer must not be older. Errors:
 * MROL_STALE. */
mrol_code mrol_replica_check_age(mrol_replica replica, uint64_t age_max_ms, mrol_error *error);

/* Says of each point whether its voxel is occupied, all at one revision.
 *
 * `occupied` is a bitmap of `occupied_bytes` bytes, MROL_BITMAP_BYTES(count) at least; bits behind the last point are 0, bytes
 * behind those are left alone. It must not overlap the points. `answer` may be NULL. Errors: MROL_INVALID_ARGUMENT, with the
 * place of a point in no voxel or outside of the region that is copied. */
mrol_code mrol_replica_query_points(mrol_replica replica, const mrol_point_query *query, uint8_t *occupied,
                                    size_t occupied_bytes, mrol_answer *answer, mrol_error *error);

/* Connects to a server, for calls that go there. Errors: MROL_INVALID_ARGUMENT, MROL_UNREACHABLE, MROL_TIMEOUT.
 *
 * Threads may share a client: calls go beside each other over one connection, which is made again where it broke. A call returns
 * within timeout_ms (but for the system's look-up of a host's name). After MROL_TIMEOUT, and MROL_UNREACHABLE of a connection that
 * broke, it is not known whether a change was made: repeat the call, with the same scan_id. */
mrol_code mrol_client_open(const mrol_client_options *options, mrol_client *client, mrol_error *error);

/* Ends a connection, once calls under way are answered. Errors: MROL_CLOSED where it is closed already, which does no harm. */
mrol_code mrol_client_close(mrol_client client, mrol_error *error);

/* Makes a map whose finest voxels have sides of `resolution_m` meters, with so many `levels` (0: 6), or finds it with just these
 * settings. Errors: MROL_REFUSED (map_exists: with others; bad_settings, ...). */
mrol_code mrol_client_create_map(mrol_client client, const char *map, double resolution_m, uint32_t levels, mrol_error *error);

/* Gives a map the name `to`, which no map has; its uuid, its revision and its robots stay. Watches and replicas under the former name
 * end. Errors: MROL_REFUSED (map_not_found; map_exists: a map is called `to`; bad_name). After MROL_TIMEOUT and MROL_UNREACHABLE look
 * which of the two names is there: the same call again could rename a map that somebody has made meanwhile. */
mrol_code mrol_client_rename_map(mrol_client client, const char *map, const char *to, mrol_error *error);

/* mrol_replica_query_points of the server's map. */
mrol_code mrol_client_query_points(mrol_client client, const char *map, const mrol_point_query *query, uint8_t *occupied,
                                   size_t occupied_bytes, mrol_answer *answer, mrol_error *error);

/* Aligns a scan to the map and, where it fits, adds it. When the call returns MROL_OK and is_accepted is 1 the scan is durable.
 * Errors: MROL_REFUSED (guess_required: the robot has no pose in a map that is not empty; scan_id_taken; map_not_found; ...). */
mrol_code mrol_client_insert_scan(mrol_client client, const char *map, const mrol_scan *scan, mrol_scan_answer *answer,
                                  mrol_error *error);

/* What inserting a scan would do; the map stays as it is. */
mrol_code mrol_client_align_scan(mrol_client client, const char *map, const mrol_scan *scan, mrol_scan_answer *answer,
                                 mrol_error *error);

/* Searches all poses for the one from which a scan was taken; the map stays as it is. Errors: MROL_REFUSED (map_empty,
 * search_too_large, ...). */
mrol_code mrol_client_localize(mrol_client client, const char *map, const mrol_localization *localization,
                               mrol_localization_answer *answer, mrol_error *error);

/* Makes a body of `links_count` links, at most MROL_LINKS_MAX; nothing of them is kept where it is. `body` is set to none on
 * failure. Errors: MROL_INVALID_ARGUMENT, which names the link and the number. */
mrol_code mrol_body_new(const mrol_link *links, size_t links_count, mrol_body *body, mrol_error *error);

/* Frees a body, once questions under way are answered. Errors: MROL_INVALID_ARGUMENT where it is freed already, which does no
 * harm. */
mrol_code mrol_body_free(mrol_body body, mrol_error *error);

/* Questions of planners, each answered at one revision. `answers` names the arrays that are written: at least as long as what
 * is asked about, apart from each other and from what is asked; bits behind the last are 0, and what is behind those is left
 * alone. In `answer`, which may be NULL, `asked` and `positive` count
 *
 *     check_poses      configurations, and those that collide
 *     check_spheres    groups, and those that collide
 *     check_motions    motions, and those that are free
 *     cast_rays        rays, and those that hit
 *     find_nearest     points, and those that have something within the radius
 *     classify_points  points, and those that are free
 *     list_frontiers   frontiers that are written, and all that there are
 *     project_grid     cells, and those that are occupied
 *
 * Keep-outs of the map count as voxels do unless scope.ignore_keep_outs is 1; where one is met instead of a voxel its name is told.
 * What the questions mean is said once, for all interfaces, in docs/guide/planners.md. A body that is asked about for the first
 * time at a level takes longer, as does a place that nobody asked about: what a question learns is kept beside the copy.
 *
 * Errors: MROL_CLOSED; MROL_INVALID_ARGUMENT, which names the field or the element, its value and its limit: a question about
 * nothing, a level that is none, a pose or direction that is none, a body that was freed; of a replica of a region what reaches out
 * of it, so that voxels that are not copied could change the answer. */
mrol_code mrol_replica_check_poses(mrol_replica replica, const mrol_pose_check *check, const mrol_collisions *answers,
                                   mrol_answer *answer, mrol_error *error);
mrol_code mrol_replica_check_spheres(mrol_replica replica, const mrol_sphere_check *check, const mrol_collisions *answers,
                                     mrol_answer *answer, mrol_error *error);
mrol_code mrol_replica_check_motions(mrol_replica replica, const mrol_motion_check *check,
                                     const mrol_motion_answers *answers, mrol_answer *answer, mrol_error *error);
mrol_code mrol_replica_cast_rays(mrol_replica replica, const mrol_ray_question *question, const mrol_ray_answers *answers,
                                 mrol_answer *answer, mrol_error *error);
mrol_code mrol_replica_find_nearest(mrol_replica replica, const mrol_nearest_question *question,
                                    const mrol_nearest_answers *answers, mrol_answer *answer, mrol_error *error);
mrol_code mrol_replica_classify_points(mrol_replica replica, const mrol_classify_question *question,
                                       const mrol_classify_answers *answers, mrol_answer *answer, mrol_error *error);
mrol_code mrol_replica_list_frontiers(mrol_replica replica, const mrol_frontier_question *question,
                                      const mrol_frontier_answers *answers, mrol_answer *answer, mrol_error *error);
mrol_code mrol_replica_project_grid(mrol_replica replica, const mrol_grid_question *question,
                                    const mrol_grid_answers *answers, mrol_answer *answer, mrol_error *error);

/* The indices x y z of a voxel in an answer: it spans [x, x + 1) * resolution * 2^level along x, and so on. */
static inline void mrol_voxel_index(uint64_t voxel, int32_t index[3]) {
    int axis;
    for (axis = 0; axis < 3; axis++) {
        /* 21 bits an axis, two's complement. */
        int32_t bits = (int32_t)(voxel >> 21 * axis & 0x1fffff);
        index[axis] = bits >= 0x100000 ? bits - 0x200000 : bits;
    }
}

/* Options with every default. */
static inline mrol_replica_options mrol_replica_options_default(void) {
    mrol_replica_options options;
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    return options;
}

/* A question about no points at level 0, by the exact set. */
static inline mrol_point_query mrol_point_query_default(void) {
    mrol_point_query query;
    memset(&query, 0, sizeof query);
    query.struct_size = sizeof query;
    return query;
}

/* A question about no configurations at level 0. */
static inline mrol_pose_check mrol_pose_check_default(void) {
    mrol_pose_check check;
    memset(&check, 0, sizeof check);
    check.struct_size = sizeof check;
    return check;
}

/* A question about no spheres at level 0. */
static inline mrol_sphere_check mrol_sphere_check_default(void) {
    mrol_sphere_check check;
    memset(&check, 0, sizeof check);
    check.struct_size = sizeof check;
    return check;
}

/* Places for nothing. */
static inline mrol_collisions mrol_collisions_default(void) {
    mrol_collisions answers;
    memset(&answers, 0, sizeof answers);
    answers.struct_size = sizeof answers;
    return answers;
}

/* A question about no motions at level 0. */
static inline mrol_motion_check mrol_motion_check_default(void) {
    mrol_motion_check check;
    memset(&check, 0, sizeof check);
    check.struct_size = sizeof check;
    return check;
}

/* Places for nothing. */
static inline mrol_motion_answers mrol_motion_answers_default(void) {
    mrol_motion_answers answers;
    memset(&answers, 0, sizeof answers);
    answers.struct_size = sizeof answers;
    return answers;
}

/* A question about no rays at level 0. */
static inline mrol_ray_question mrol_ray_question_default(void) {
    mrol_ray_question question;
    memset(&question, 0, sizeof question);
    question.struct_size = sizeof question;
    return question;
}

/* Places for nothing. */
static inline mrol_ray_answers mrol_ray_answers_default(void) {
    mrol_ray_answers answers;
    memset(&answers, 0, sizeof answers);
    answers.struct_size = sizeof answers;
    return answers;
}

/* A question about no points at level 0, without a radius. */
static inline mrol_nearest_question mrol_nearest_question_default(void) {
    mrol_nearest_question question;
    memset(&question, 0, sizeof question);
    question.struct_size = sizeof question;
    return question;
}

/* Places for nothing. */
static inline mrol_nearest_answers mrol_nearest_answers_default(void) {
    mrol_nearest_answers answers;
    memset(&answers, 0, sizeof answers);
    answers.struct_size = sizeof answers;
    return answers;
}

/* A question about no points at level 0. */
static inline mrol_classify_question mrol_classify_question_default(void) {
    mrol_classify_question question;
    memset(&question, 0, sizeof question);
    question.struct_size = sizeof question;
    return question;
}

/* Places for nothing. */
static inline mrol_classify_answers mrol_classify_answers_default(void) {
    mrol_classify_answers answers;
    memset(&answers, 0, sizeof answers);
    answers.struct_size = sizeof answers;
    return answers;
}

/* A question about the box at the origin at level 0, with every default. */
static inline mrol_frontier_question mrol_frontier_question_default(void) {
    mrol_frontier_question question;
    memset(&question, 0, sizeof question);
    question.struct_size = sizeof question;
    return question;
}

/* Places for nothing. */
static inline mrol_frontier_answers mrol_frontier_answers_default(void) {
    mrol_frontier_answers answers;
    memset(&answers, 0, sizeof answers);
    answers.struct_size = sizeof answers;
    return answers;
}

/* A question about all of the map at level 0. */
static inline mrol_grid_question mrol_grid_question_default(void) {
    mrol_grid_question question;
    memset(&question, 0, sizeof question);
    question.struct_size = sizeof question;
    return question;
}

/* Places for nothing. */
static inline mrol_grid_answers mrol_grid_answers_default(void) {
    mrol_grid_answers answers;
    memset(&answers, 0, sizeof answers);
    answers.struct_size = sizeof answers;
    return answers;
}

/* Options with every default. */
static inline mrol_client_options mrol_client_options_default(void) {
    mrol_client_options options;
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    return options;
}

/* A scan without points at its robot's last pose. */
static inline mrol_scan mrol_scan_default(void) {
    mrol_scan scan;
    memset(&scan, 0, sizeof scan);
    scan.struct_size = sizeof scan;
    return scan;
}

/* A question about no points, with every default. */
static inline mrol_localization mrol_localization_default(void) {
    mrol_localization localization;
    memset(&localization, 0, sizeof localization);
    localization.struct_size = sizeof localization;
    return localization;
}

#ifdef __cplusplus
}
#endif

#endif
