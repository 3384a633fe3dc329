"""A robot of ROS 2 on an mrol server: its clouds go into the shared map, and its pose and the map come back.

`node` and `messages` know ROS. All other modules know none: they take arrays, numbers and `mrol.Pose`.
"""
