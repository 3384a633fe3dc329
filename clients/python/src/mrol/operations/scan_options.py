"""What the options of `insert` and `align` mean."""

SCAN_OPTIONS = {
    "guess": "Where the scan is thought to have been taken (`map_from_sensor`), a pose. Without it, `motion` and "
    "`constant_velocity` that is the robot's last accepted pose.",
    "motion": "In its place: how far from the robot's last accepted pose (`last_from_sensor`), a pose: odometry.",
    "constant_velocity": "In its place: as far from the last accepted pose as that is from the one before, by the timestamps where "
    "all three scans have one.",
    "align": "False adds the scan at its guess, without aligning it.",
    "robot": "In whose name it is sent; that of the map without it.",
    "scan_id": "A number by which the server knows the scan if it is sent twice. The package gives one.",
    "session": "The run of the robot's program in which `scan_id` counts; only with a `scan_id`. The package gives one.",
    "timestamp_ns": "When it was taken, nanoseconds since 1970; kept with the pose.",
    "point_times": "Of a sensor that moves during its sweep: when each point was taken, seconds from `timestamp_ns`, shape (n,).",
    "point_times_from_sweep_start": "True says that these times count from the beginning of the sweep, and `timestamp_ns` "
    "is its end.",
    "gravity_in_sensor": "The direction in which things fall, x y z in the sensor frame, of any length; an accelerometer at rest "
    "reads the opposite. No pose is accepted that is off by more than 5 degrees.",
    "guess_covariance": "How far off the guess may be, shape (6, 6): x y z in meters along the map's axes, then turns about them "
    "in radians. No pose is accepted more than 4.7 standard deviations away.",
    "recover": "Whether the robot is looked for where the scan is refused. Without it as the robot's settings say.",
    "carve": "Whether what the scan saw through is taken out of the map where it is accepted. Without it as the robot's settings "
    "say; True takes a key of scope `write` where they do not carve.",
    "force": "True adds it where it was found even if the verdict is not `accepted`.",
    "method": '"refined" or "overlap" (that of the paper). Without it as the server\'s settings say.',
    "range_min_m": "Nearer points are skipped, meters. Without it as the robot's settings say.",
    "range_max_m": "Farther points are skipped, meters. Without it as the robot's settings say.",
    "body_m": "A `Box`, or its two corners, in the sensor frame: points in it are of the robot itself, and skipped. Without it as "
    "the robot's settings say.",
    "sensor": 'How the rays of the sensor lie, "spinning RINGS COLUMNS LOWEST_DEG HIGHEST_DEG" or "pinhole WIDTH HEIGHT FX FY". '
    "Without it as the robot's settings say.",
    "strict": "True refuses points that are not finite, which are skipped otherwise.",
    "foreground_level": "Lets the answer tell too which points fall in no occupied voxel of that level: what is new in the scan.",
}
