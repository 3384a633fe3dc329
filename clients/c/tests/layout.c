/* Prints how the header lays its structs out, for a test of src/abi.rs to compare. */
#include <mrol.h>
#include <stddef.h>
#include <stdio.h>

#define FIELD(of, field) printf(#of "." #field " %lu\n", (unsigned long)offsetof(of, field))
#define SIZE(of) printf(#of " %lu\n", (unsigned long)sizeof(of))

int main(void) {
    FIELD(mrol_error, code);
    FIELD(mrol_error, reserved);
    FIELD(mrol_error, reason);
    FIELD(mrol_error, message);
    SIZE(mrol_error);

    FIELD(mrol_replica, number);
    SIZE(mrol_replica);

    FIELD(mrol_map_version, map_uuid);
    FIELD(mrol_map_version, revision);
    FIELD(mrol_map_version, content_hash);
    FIELD(mrol_map_version, has_content_hash);
    FIELD(mrol_map_version, reserved);
    SIZE(mrol_map_version);

    FIELD(mrol_replica_options, struct_size);
    FIELD(mrol_replica_options, address);
    FIELD(mrol_replica_options, map);
    FIELD(mrol_replica_options, key);
    FIELD(mrol_replica_options, ca_file);
    FIELD(mrol_replica_options, certificate_file);
    FIELD(mrol_replica_options, private_key_file);
    FIELD(mrol_replica_options, open_timeout_ms);
    FIELD(mrol_replica_options, silence_timeout_ms);
    FIELD(mrol_replica_options, blocks_max);
    FIELD(mrol_replica_options, region_min_m);
    FIELD(mrol_replica_options, region_max_m);
    FIELD(mrol_replica_options, has_region);
    FIELD(mrol_replica_options, with_filter);
    FIELD(mrol_replica_options, reserved);
    SIZE(mrol_replica_options);

    FIELD(mrol_point_query, struct_size);
    FIELD(mrol_point_query, xyz);
    FIELD(mrol_point_query, count);
    FIELD(mrol_point_query, map_from_points);
    FIELD(mrol_point_query, level);
    FIELD(mrol_point_query, lookup);
    SIZE(mrol_point_query);

    FIELD(mrol_answer, version);
    FIELD(mrol_answer, asked);
    FIELD(mrol_answer, positive);
    FIELD(mrol_answer, reserved);
    SIZE(mrol_answer);

    FIELD(mrol_replica_status, version);
    FIELD(mrol_replica_status, head_revision);
    FIELD(mrol_replica_status, resets);
    FIELD(mrol_replica_status, is_connected);
    FIELD(mrol_replica_status, reserved);
    FIELD(mrol_replica_status, last_error);
    SIZE(mrol_replica_status);
    return 0;
}
