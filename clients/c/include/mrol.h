/* A replica of an mrol map, in this process: a copy that follows the server's map and answers without a call.
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
 * returns MROL_OK, or a code with its reason in `error`. After an error no output but `error` has been written, unless the
 * function says otherwise. No function calls back, prints, exits, or lets an exception or a panic out.
 *
 * OWNERSHIP. All memory is the caller's. The library reads what a pointer points to during the call alone and keeps no
 * pointer; it returns none that must be freed. Strings that it returns are constants.
 *
 * THREADS. Every function may be called from any thread at any time, on the same replica too. Questions of several threads run
 * beside each other. A question waits for a change that is being applied to the copy, about a millisecond. Memory that is
 * passed in must not be written by another thread meanwhile.
 *
 * LIFETIME. A replica is a number, not a pointer: it lives from mrol_replica_open to mrol_replica_close. Using one after that
 * is MROL_CLOSED, closing one twice as well, and no other replica gets its number. Closing one that other threads use is fine:
 * questions under way are answered, waits end with MROL_CLOSED. All replicas of a process share one thread for the network and
 * at most two that apply changes; they end with the last replica. The library may be unloaded (dlclose) when all replicas are closed
 * and every call has returned.
 *
 * FORK. Replicas stay with the process that opened them. A child of fork() gets MROL_FORKED from each function that takes or
 * opens one; it may exec. Fork before the first mrol_replica_open if a child is to open replicas of its own.
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

/* Version of this interface. A library is of use to programs that were compiled against the same one. */
#define MROL_ABI_VERSION 1

/* Bytes of a reason and of a message with their terminating zero. */
#define MROL_REASON_BYTES 48
#define MROL_MESSAGE_BYTES 464

/* Most points of one query. */
#define MROL_POINTS_MAX ((size_t)1 << 27)

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
    MROL_INTERNAL = 9
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
    /* gRPC address of the server: "http://127.0.0.1:7334", "https://robot-7:7334" or "unix:/run/mrol/grpc.sock". */
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
    /* Not used: zero. */
    uint8_t reserved[6];
} mrol_replica_options;

/* Which structure of a level answers. */
typedef int32_t mrol_lookup;
enum {
    /* The exact set. */
    MROL_LOOKUP_EXACT = 0,
    /* The Bloom filter: now and then "occupied" of a free voxel, never "free" of an occupied one. */
    MROL_LOOKUP_BLOOM = 1
};

/* A question about points: are their voxels occupied? Keep-outs of the map are not regarded. Take it from mrol_point_query_default(). */
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
} mrol_point_query;

/* What all answers have, whatever was asked: all of one answer is of one revision. */
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
    /* Not used: zero. */
    uint8_t reserved[7];
    /* Why the connection was lost last, UTF-8; empty while it stands. */
    char last_error[MROL_MESSAGE_BYTES];
} mrol_replica_status;

/* Version of the library, "0.1.0", and of the interface that it has: MROL_ABI_VERSION of its own header. */
const char *mrol_library_version(void);
uint32_t mrol_abi_version(void);

/* The name of a code: "MROL_TIMEOUT"; "MROL_UNKNOWN" of a number that is none. */
const char *mrol_code_name(mrol_code code);

/* Copies a map and follows it from then on; returns when the copy is complete. `replica` is set to none on failure.
 *
 * Where the connection breaks the replica comes back by itself and goes on from its last revision; meanwhile it answers as
 * it is. The system's look-up of a host's name is waited for, also beyond the time-out.
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

/* Says of each point whether its voxel is occupied, all at one revision.
 *
 * `occupied` is a bitmap of `occupied_bytes` bytes, MROL_BITMAP_BYTES(count) at least; bits behind the last point are 0, bytes
 * behind those are left alone. It must not overlap the points. `answer` may be NULL. Errors: MROL_INVALID_ARGUMENT, with the
 * place of a point in no voxel or outside of the region that is copied. */
mrol_code mrol_replica_query_points(mrol_replica replica, const mrol_point_query *query, uint8_t *occupied,
                                    size_t occupied_bytes, mrol_answer *answer, mrol_error *error);

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

#ifdef __cplusplus
}
#endif

#endif
