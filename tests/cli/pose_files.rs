//! Poses of other programs: folders of 3DTK, and files of KITTI.

use std::fs;

use mrol::scan::{read_points, read_trajectory};

use super::{Sequence, complaint, mrol, objects};

/// The sequence in a folder of 3DTK, and its poses in a file of KITTI.
struct Converted {
    folder: tempfile::TempDir,
}

impl Converted {
    fn of(sequence: &Sequence, scans: usize) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let poses = read_trajectory(sequence.path("poses.txt").as_ref()).unwrap();
        let mut rows = String::new();
        for (k, pose) in poses.iter().take(scans).enumerate() {
            let points = read_points(format!("{}/{k:04}.ply", sequence.path("scans")).as_ref()).unwrap();
            let in_uos = |[x, y, z]: [f64; 3]| [-y * 100.0, z * 100.0, x * 100.0];
            let line = |[x, y, z]: [f64; 3]| format!("{x} {y} {z} 17\n");
            let lines = points.iter().map(|point| line(in_uos(point.xyz().map(f64::from))));
            let path = |extension: &str| folder.path().join(format!("scan{k:03}.{extension}"));
            fs::write(path("3d"), lines.collect::<String>()).unwrap();
            let pose = pose.map_from_sensor;
            let [x, y, z] = in_uos(pose.translation.vector.into());
            // About x, y and z of 3DTK, in the axes of the robot and left-handed: about -y, z, x.
            let m = pose.rotation.to_rotation_matrix();
            let of_uos = |row: usize, column: usize| {
                let (axis, sign) = ([1, 2, 0], [-1.0, 1.0, 1.0]);
                m[(axis[row], axis[column])] * sign[row] * sign[column]
            };
            let about_y = of_uos(0, 2).clamp(-1.0, 1.0).asin();
            // Turned to a side, one of the other two angles is free.
            let [about_x, about_z] = match of_uos(0, 2).abs() < 1.0 - 1e-9 {
                true => [(-of_uos(1, 2)).atan2(of_uos(2, 2)), (-of_uos(0, 1)).atan2(of_uos(0, 0))],
                false => [of_uos(2, 1).atan2(of_uos(1, 1)), 0.0],
            };
            let angles = [about_x, about_y, about_z].map(|angle: f64| angle.to_degrees().to_string());
            fs::write(path("pose"), format!("{x} {y} {z}\n{}\n", angles.join(" "))).unwrap();
            let matrix = pose.to_homogeneous();
            let numbers = (0..12).map(|k| format!("{:.9e}", matrix[(k / 4, k % 4)]));
            rows += &(numbers.collect::<Vec<_>>().join(" ") + "\n");
        }
        fs::write(folder.path().join("kitti.txt"), rows).unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }
}

#[test]
fn folders_of_3dtk_and_poses_of_kitti_give_the_map_of_the_same_scans() {
    let sequence = Sequence::of(3);
    let converted = Converted::of(&sequence, 3);
    let (scans, dat) = (sequence.path("scans"), converted.path(""));
    let mapped = |scans: &str, poses: &str| {
        let lines = objects(&["map", scans, "--resolution", "0.1", "--poses", poses]);
        let voxels: Vec<u64> = lines[..3].iter().map(|line| line["voxels"].as_u64().unwrap()).collect();
        (voxels, lines[2]["map_from_sensor"]["translation_m"].clone())
    };
    let (truth, place) = mapped(&scans, &sequence.path("poses.txt"));
    let near = |(voxels, at): (Vec<u64>, serde_json::Value)| {
        // Points on the faces between voxels are rounded otherwise.
        let is_near = |(a, b): (&u64, &u64)| a.abs_diff(*b) * 100 <= *b;
        assert!(voxels.iter().zip(&truth).all(is_near), "{voxels:?} {truth:?}");
        let off = (0..3).map(|k| (at[k].as_f64().unwrap() - place[k].as_f64().unwrap()).abs());
        assert!(off.fold(0.0, f64::max) < 1e-6, "{at} {place}");
    };
    near(mapped(&dat, &dat));
    near(mapped(&scans, &converted.path("kitti.txt")));
    let kitti = converted.path("kitti.txt");
    let told = mrol(&["map", &scans, "--resolution", "0.1", "--poses", &kitti]).output().unwrap();
    assert!(String::from_utf8_lossy(&told.stderr).contains("KITTI"), "{told:?}");
}

#[test]
fn a_folder_without_the_pose_of_a_scan_says_what_is_missing() {
    let sequence = Sequence::of(2);
    let converted = Converted::of(&sequence, 2);
    let map =
        |scans: &str| complaint(&["map", scans, "--resolution", "0.1", "--poses", &converted.path("")], 1);
    assert!(map(&sequence.path("scans")).contains("there is no 0000.pose"));
    // Poses that are read are not replaced by those that are found.
    let pose = converted.path("scan000.pose");
    let dat = converted.path("");
    let said =
        complaint(&["map", &dat, "--resolution", "0.1", "--poses", &dat, "--trajectory-out", &pose], 2);
    assert!(said.contains("scan000.pose") && said.contains("would be replaced"), "{said}");
    fs::remove_file(converted.path("scan001.pose")).unwrap();
    assert!(map(&converted.path("")).contains("scan001.pose: "));
}
