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
    FIELD(mrol_replica_options, without_viewpoints);
    FIELD(mrol_replica_options, reserved);
    FIELD(mrol_replica_options, age_max_ms);
    SIZE(mrol_replica_options);

    FIELD(mrol_point_query, struct_size);
    FIELD(mrol_point_query, xyz);
    FIELD(mrol_point_query, count);
    FIELD(mrol_point_query, map_from_points);
    FIELD(mrol_point_query, level);
    FIELD(mrol_point_query, lookup);
    FIELD(mrol_point_query, keep_out);
    FIELD(mrol_point_query, reserved);
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
    FIELD(mrol_replica_status, has_ended);
    FIELD(mrol_replica_status, reserved);
    FIELD(mrol_replica_status, age_ms);
    FIELD(mrol_replica_status, last_error);
    SIZE(mrol_replica_status);

    FIELD(mrol_client, number);
    SIZE(mrol_client);

    FIELD(mrol_credentials, key);
    FIELD(mrol_credentials, ca_file);
    FIELD(mrol_credentials, certificate_file);
    FIELD(mrol_credentials, private_key_file);
    SIZE(mrol_credentials);

    FIELD(mrol_client_options, struct_size);
    FIELD(mrol_client_options, address);
    FIELD(mrol_client_options, credentials);
    FIELD(mrol_client_options, timeout_ms);
    SIZE(mrol_client_options);

    FIELD(mrol_scan, struct_size);
    FIELD(mrol_scan, robot);
    FIELD(mrol_scan, session);
    FIELD(mrol_scan, scan_id);
    FIELD(mrol_scan, xyz);
    FIELD(mrol_scan, count);
    FIELD(mrol_scan, guess);
    FIELD(mrol_scan, motion);
    FIELD(mrol_scan, gravity);
    FIELD(mrol_scan, timestamp_ns);
    FIELD(mrol_scan, point_times_s);
    FIELD(mrol_scan, has_scan_id);
    FIELD(mrol_scan, has_timestamp);
    FIELD(mrol_scan, at_guess);
    FIELD(mrol_scan, force);
    FIELD(mrol_scan, reserved);
    SIZE(mrol_scan);

    FIELD(mrol_scan_answer, version);
    FIELD(mrol_scan_answer, map_from_sensor);
    FIELD(mrol_scan_answer, overlap);
    FIELD(mrol_scan_answer, information);
    FIELD(mrol_scan_answer, new_voxels);
    FIELD(mrol_scan_answer, carved_voxels);
    FIELD(mrol_scan_answer, points_skipped);
    FIELD(mrol_scan_answer, is_accepted);
    FIELD(mrol_scan_answer, is_replayed);
    FIELD(mrol_scan_answer, is_stationary);
    FIELD(mrol_scan_answer, has_information);
    FIELD(mrol_scan_answer, reserved);
    FIELD(mrol_scan_answer, verdict);
    FIELD(mrol_scan_answer, reason);
    SIZE(mrol_scan_answer);

    FIELD(mrol_localization, struct_size);
    FIELD(mrol_localization, xyz);
    FIELD(mrol_localization, count);
    FIELD(mrol_localization, gravity);
    FIELD(mrol_localization, time_limit_ms);
    FIELD(mrol_localization, seed);
    SIZE(mrol_localization);

    FIELD(mrol_localization_answer, map_from_sensor);
    FIELD(mrol_localization_answer, overlap);
    FIELD(mrol_localization_answer, agreement);
    FIELD(mrol_localization_answer, candidates);
    FIELD(mrol_localization_answer, is_accepted);
    FIELD(mrol_localization_answer, is_cut_short);
    FIELD(mrol_localization_answer, reserved);
    FIELD(mrol_localization_answer, verdict);
    FIELD(mrol_localization_answer, reason);
    SIZE(mrol_localization_answer);

    FIELD(mrol_body, number);
    SIZE(mrol_body);

    FIELD(mrol_link, spheres);
    FIELD(mrol_link, spheres_count);
    FIELD(mrol_link, points);
    FIELD(mrol_link, points_count);
    FIELD(mrol_link, padding_m);
    FIELD(mrol_link, reserved);
    SIZE(mrol_link);

    FIELD(mrol_region, kind);
    FIELD(mrol_region, reserved);
    FIELD(mrol_region, numbers);
    SIZE(mrol_region);

    FIELD(mrol_scope, level);
    FIELD(mrol_scope, ignore_keep_outs);
    FIELD(mrol_scope, reserved);
    SIZE(mrol_scope);

    FIELD(mrol_pose_check, struct_size);
    FIELD(mrol_pose_check, scope);
    FIELD(mrol_pose_check, body);
    FIELD(mrol_pose_check, configurations);
    FIELD(mrol_pose_check, count);
    FIELD(mrol_pose_check, ignored);
    FIELD(mrol_pose_check, ignored_count);
    FIELD(mrol_pose_check, clearance_max_m);
    FIELD(mrol_pose_check, unknown_is_occupied);
    FIELD(mrol_pose_check, reserved);
    SIZE(mrol_pose_check);

    FIELD(mrol_sphere_check, struct_size);
    FIELD(mrol_sphere_check, scope);
    FIELD(mrol_sphere_check, spheres);
    FIELD(mrol_sphere_check, count);
    FIELD(mrol_sphere_check, sizes);
    FIELD(mrol_sphere_check, groups);
    FIELD(mrol_sphere_check, ignored);
    FIELD(mrol_sphere_check, ignored_count);
    FIELD(mrol_sphere_check, padding_m);
    FIELD(mrol_sphere_check, clearance_max_m);
    FIELD(mrol_sphere_check, unknown_is_occupied);
    FIELD(mrol_sphere_check, reserved);
    SIZE(mrol_sphere_check);

    FIELD(mrol_collisions, struct_size);
    FIELD(mrol_collisions, capacity);
    FIELD(mrol_collisions, colliding);
    FIELD(mrol_collisions, hit_links);
    FIELD(mrol_collisions, hit_parts);
    FIELD(mrol_collisions, hit_voxels);
    FIELD(mrol_collisions, clearances_m);
    FIELD(mrol_collisions, nearest_links);
    FIELD(mrol_collisions, hit_keep_outs);
    SIZE(mrol_collisions);

    FIELD(mrol_motion_check, struct_size);
    FIELD(mrol_motion_check, scope);
    FIELD(mrol_motion_check, body);
    FIELD(mrol_motion_check, configurations);
    FIELD(mrol_motion_check, count);
    FIELD(mrol_motion_check, lengths);
    FIELD(mrol_motion_check, motions);
    FIELD(mrol_motion_check, ignored);
    FIELD(mrol_motion_check, ignored_count);
    FIELD(mrol_motion_check, step_m);
    FIELD(mrol_motion_check, clearance_max_m);
    FIELD(mrol_motion_check, unknown_is_occupied);
    FIELD(mrol_motion_check, reserved);
    SIZE(mrol_motion_check);

    FIELD(mrol_motion_answers, struct_size);
    FIELD(mrol_motion_answers, capacity);
    FIELD(mrol_motion_answers, is_free);
    FIELD(mrol_motion_answers, first_hits);
    FIELD(mrol_motion_answers, clearances_m);
    SIZE(mrol_motion_answers);

    FIELD(mrol_ray_question, struct_size);
    FIELD(mrol_ray_question, scope);
    FIELD(mrol_ray_question, origins);
    FIELD(mrol_ray_question, origins_count);
    FIELD(mrol_ray_question, directions);
    FIELD(mrol_ray_question, ends);
    FIELD(mrol_ray_question, count);
    FIELD(mrol_ray_question, range_m);
    FIELD(mrol_ray_question, unknown_is_occupied);
    FIELD(mrol_ray_question, reserved);
    SIZE(mrol_ray_question);

    FIELD(mrol_ray_answers, struct_size);
    FIELD(mrol_ray_answers, capacity);
    FIELD(mrol_ray_answers, hit);
    FIELD(mrol_ray_answers, distances_m);
    FIELD(mrol_ray_answers, voxels);
    FIELD(mrol_ray_answers, keep_outs);
    SIZE(mrol_ray_answers);

    FIELD(mrol_nearest_question, struct_size);
    FIELD(mrol_nearest_question, scope);
    FIELD(mrol_nearest_question, points);
    FIELD(mrol_nearest_question, count);
    FIELD(mrol_nearest_question, radius_m);
    FIELD(mrol_nearest_question, to);
    FIELD(mrol_nearest_question, reserved);
    SIZE(mrol_nearest_question);

    FIELD(mrol_nearest_answers, struct_size);
    FIELD(mrol_nearest_answers, capacity);
    FIELD(mrol_nearest_answers, found);
    FIELD(mrol_nearest_answers, distances_m);
    FIELD(mrol_nearest_answers, voxels);
    FIELD(mrol_nearest_answers, away);
    FIELD(mrol_nearest_answers, keep_outs);
    SIZE(mrol_nearest_answers);

    FIELD(mrol_classify_question, struct_size);
    FIELD(mrol_classify_question, scope);
    FIELD(mrol_classify_question, points);
    FIELD(mrol_classify_question, count);
    SIZE(mrol_classify_question);

    FIELD(mrol_classify_answers, struct_size);
    FIELD(mrol_classify_answers, capacity);
    FIELD(mrol_classify_answers, is_occupied);
    FIELD(mrol_classify_answers, is_free);
    SIZE(mrol_classify_answers);

    FIELD(mrol_frontier_question, struct_size);
    FIELD(mrol_frontier_question, scope);
    FIELD(mrol_frontier_question, min_m);
    FIELD(mrol_frontier_question, max_m);
    FIELD(mrol_frontier_question, standoff_m);
    FIELD(mrol_frontier_question, size_min);
    SIZE(mrol_frontier_question);

    FIELD(mrol_frontier, voxels);
    FIELD(mrol_frontier, center_m);
    FIELD(mrol_frontier, min_m);
    FIELD(mrol_frontier, max_m);
    FIELD(mrol_frontier, view_m);
    FIELD(mrol_frontier, view_rotation);
    FIELD(mrol_frontier, target_m);
    FIELD(mrol_frontier, yaw_rad);
    FIELD(mrol_frontier, elevation_rad);
    FIELD(mrol_frontier, has_view);
    FIELD(mrol_frontier, reserved);
    SIZE(mrol_frontier);

    FIELD(mrol_frontier_answers, struct_size);
    FIELD(mrol_frontier_answers, capacity);
    FIELD(mrol_frontier_answers, frontiers);
    SIZE(mrol_frontier_answers);

    FIELD(mrol_grid_question, struct_size);
    FIELD(mrol_grid_question, scope);
    FIELD(mrol_grid_question, area_min_m);
    FIELD(mrol_grid_question, area_max_m);
    FIELD(mrol_grid_question, min_z_m);
    FIELD(mrol_grid_question, max_z_m);
    FIELD(mrol_grid_question, cell_m);
    FIELD(mrol_grid_question, has_area);
    FIELD(mrol_grid_question, has_min_z);
    FIELD(mrol_grid_question, has_max_z);
    FIELD(mrol_grid_question, tell_unknown);
    FIELD(mrol_grid_question, band_from);
    FIELD(mrol_grid_question, reserved);
    SIZE(mrol_grid_question);

    FIELD(mrol_grid_shape, cell_m);
    FIELD(mrol_grid_shape, origin_m);
    FIELD(mrol_grid_shape, cells);
    FIELD(mrol_grid_shape, floor_min_m);
    FIELD(mrol_grid_shape, floor_max_m);
    SIZE(mrol_grid_shape);

    FIELD(mrol_grid_answers, struct_size);
    FIELD(mrol_grid_answers, capacity);
    FIELD(mrol_grid_answers, shape);
    FIELD(mrol_grid_answers, occupied);
    FIELD(mrol_grid_answers, tops_m);
    FIELD(mrol_grid_answers, is_free);
    SIZE(mrol_grid_answers);
    return 0;
}
