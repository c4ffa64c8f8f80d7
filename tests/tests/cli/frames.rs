//! Parquet files with a wrong byte.

use hyd_frames::{Cells, Frame, FrameWriter, Kind};

/// Whatever byte is wrong, the file is read or refused.
#[test]
fn a_wrong_byte_is_no_panic() {
    let path = std::env::temp_dir().join(format!("hyd-frame-{}.parquet", std::process::id()));
    let columns = [("time", Kind::Number), ("shot", Kind::Whole), ("note", Kind::Text)];
    let file = std::fs::File::create(&path).expect("made");
    let mut writer = FrameWriter::new(file, columns.into_iter(), &[("key".into(), "value".into())]).expect("begun");
    let cells = [
        Cells::Numbers(vec![0.0, 0.5, 1.0]),
        Cells::Wholes(vec![1, 2, 3]),
        Cells::Texts(["a", "", "long"].map(String::from).to_vec()),
    ];
    writer.group(&cells).expect("written");
    writer.finish().expect("written");
    assert_eq!(Frame::read(&path).expect("whole").column("shot"), Some(&cells[1]));
    let whole = std::fs::read(&path).expect("readable");
    let mut refused = 0;
    for at in 0..whole.len() {
        for wrong in [0, 0x7f, 0xff, whole[at] ^ 1] {
            let mut bytes = whole.clone();
            bytes[at] = wrong;
            std::fs::write(&path, bytes).expect("written");
            refused += usize::from(Frame::read(&path).is_err());
        }
    }
    assert!(refused > whole.len() / 2, "{refused} of {}", 4 * whole.len());
    std::fs::remove_file(&path).expect("removed");
}
