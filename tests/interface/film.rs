//! Films: decoded frames, and films made by the program and by the window.

use rusty_h264_decoder::Decoder;
use shiguredo_mp4::bitstream::h264::{LengthSize, length_prefixed_to_annexb};
use shiguredo_mp4::boxes::SampleEntry;
use shiguredo_mp4::demux::{Input, Mp4FileDemuxer};

use std::path::Path;
use std::process::Command;

use eframe::egui::accesskit::Role;
use egui_kittest::kittest::Queryable as _;
use jointplay::film::{Film, FilmError, FilmFormat};

use crate::hands::give_graphics;
use crate::hands::page::{click, decoded, label, next_file, window};

/// A disc of `colour` that moves to the right on a light slope.
fn picture([width, height]: [u32; 2], k: u32, colour: [u8; 3]) -> Vec<u8> {
    let mut rgba = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let (dx, dy) = (f64::from(x) - 30.0 - 3.0 * f64::from(k), f64::from(y) - 30.0);
            let inside = dx * dx + dy * dy < 400.0;
            let background = [200 + (x / 8) as u8, 200, 210];
            rgba.extend(if inside { colour } else { background });
            rgba.push(255);
        }
    }
    rgba
}

/// The frames of an MP4: time (s), whether it is a key frame, and red, green, blue by BT.709.
fn decode(file: &[u8], [width, height]: [usize; 2]) -> Vec<(f64, bool, Vec<u8>)> {
    let mut demuxer = Mp4FileDemuxer::new();
    while let Some(input) = demuxer.required_input() {
        let from = input.position as usize;
        let size = input.size.unwrap_or(file.len() - from);
        demuxer.handle_input(Input { position: input.position, data: &file[from..from + size] });
    }
    let mut decoder = Decoder::new();
    let mut frames = Vec::new();
    while let Some(sample) = demuxer.next_sample().unwrap() {
        let mut unit = Vec::new();
        if let Some(SampleEntry::Avc1(entry)) = sample.sample_entry {
            for set in entry.avcc_box.sps_list.iter().chain(&entry.avcc_box.pps_list) {
                unit.extend([0, 0, 0, 1]);
                unit.extend(set);
            }
        }
        let from = sample.data_offset as usize;
        let data = &file[from..from + sample.data_size];
        unit.extend(length_prefixed_to_annexb(data, LengthSize::FourBytes).unwrap());
        let yuv = decoder.decode(&unit).unwrap().expect("a frame");
        let mut rgb = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let luma = (f64::from(yuv.y[y * width + x]) - 16.0) * 255.0 / 219.0;
                let at = y / 2 * (width / 2) + x / 2;
                let part = |plane: &[u8]| (f64::from(plane[at]) - 128.0) * 255.0 / 224.0;
                let (blue, red) = (part(&yuv.u), part(&yuv.v));
                // The inverse of BT.709-6, Table 3, to five digits.
                let colour = [luma + 1.5748 * red, luma - 0.18732 * blue - 0.46812 * red, luma + 1.8556 * blue];
                rgb.extend(colour.map(|part| part.round().clamp(0.0, 255.0) as u8));
            }
        }
        let time = sample.timestamp as f64 / f64::from(sample.track.timescale.get());
        frames.push((time, sample.keyframe, rgb));
    }
    frames
}

/// Peak signal-to-noise ratio of two pictures, dB.
fn signal_to_noise(signal: &[u8], rgb: &[u8]) -> f64 {
    let square = |(a, b): (&u8, &u8)| (f64::from(*a) - f64::from(*b)).powi(2);
    let sum: f64 = signal.iter().zip(rgb).map(square).sum();
    10.0 * (255.0_f64.powi(2) * signal.len() as f64 / sum).log10()
}

#[test]
fn an_mp4_has_the_frames_at_their_times_in_their_colours() {
    // Not a multiple of 16: the decoder must crop the frame.
    let size = [200, 90];
    for (rate, colour) in [(30.0, [200, 40, 30]), (29.97, [20, 60, 190])] {
        let mut film = Film::new(FilmFormat::Mp4, size, rate).unwrap();
        let pictures: Vec<Vec<u8>> = (0..70).map(|k| picture(size, k, colour)).collect();
        for picture in &pictures {
            film.add(picture).unwrap();
        }
        assert_eq!(film.frames(), 70);
        let file = film.finish().unwrap();
        let frames = decode(&file, size.map(|edge| edge as usize));
        assert_eq!(frames.len(), 70);
        for (k, ((time, key, rgb), picture)) in frames.iter().zip(&pictures).enumerate() {
            assert!((time - k as f64 / rate).abs() < 1e-9, "{time}");
            assert_eq!(*key, k % 60 == 0, "{k}");
            let expected: Vec<u8> = picture.chunks_exact(4).flat_map(|pixel| pixel[..3].to_vec()).collect();
            // Chroma subsampling blurs the edge of the disc.
            let ratio = signal_to_noise(&expected, rgb);
            assert!(ratio > 30.0, "{k}: {ratio}");
            // Away from edges the colours are preserved.
            for (x, y) in [(30 + 3 * k, 30), (4, 80)] {
                let at = y * 200 + x;
                if x >= 200 {
                    continue;
                }
                for part in 0..3 {
                    let difference = i32::from(expected[3 * at + part]) - i32::from(rgb[3 * at + part]);
                    assert!(difference.abs() <= 6, "{k} {x} {y}: {difference}");
                }
            }
        }
    }
}

#[test]
fn a_gif_keeps_its_frame_rate_and_draws_only_changes() {
    let size = [120, 64];
    let mut film = Film::new(FilmFormat::Gif, size, 30.0).unwrap();
    let pictures: Vec<Vec<u8>> = (0..30).map(|k| picture(size, k, [200, 40, 30])).collect();
    for picture in &pictures {
        film.add(picture).unwrap();
    }
    // A frame like the one before.
    film.add(&pictures[29]).unwrap();
    let file = film.finish().unwrap();

    let mut options = ::gif::DecodeOptions::new();
    options.set_color_output(::gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(&file[..]).unwrap();
    assert_eq!(decoder.repeat(), ::gif::Repeat::Infinite);
    let mut canvas = vec![0; pictures[0].len()];
    let (mut k, mut hundredths) = (0, 0);
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        assert!(frame.delay == 3 || frame.delay == 4);
        hundredths += u32::from(frame.delay);
        let [left, top, width, height] = [frame.left, frame.top, frame.width, frame.height].map(usize::from);
        for y in 0..height {
            let to = 4 * ((top + y) * 120 + left);
            let from = 4 * y * width;
            canvas[to..to + 4 * width].copy_from_slice(&frame.buffer[from..from + 4 * width]);
        }
        let picture = &pictures[k.min(29)];
        let ratio = signal_to_noise(picture, &canvas);
        assert!(ratio > 35.0, "{k}: {ratio}");
        k += 1;
    }
    assert_eq!((k, hundredths), (31, 103));
}

#[test]
fn films_beyond_the_limits_of_players_are_refused() {
    let error = |format, size, rate| Film::new(format, size, rate).err().unwrap().to_string();
    assert!(error(FilmFormat::Mp4, [201, 90], 30.0).contains("must be even"));
    assert!(error(FilmFormat::Mp4, [16_384, 16_384], 30.0).contains("8192x4320"));
    assert!(error(FilmFormat::Mp4, [1280, 720], 0.0).contains("frames a second"));
    assert!(error(FilmFormat::Gif, [200, 90], 60.0).contains("50 frames"));
    assert!(error(FilmFormat::Gif, [70_000, 90], 20.0).contains("65535"));
    let film = Film::new(FilmFormat::Mp4, [16, 16], 30.0).unwrap();
    assert_eq!(film.finish(), Err(FilmError::Empty));
}

/// Runs the program in `folder`.
fn jointplay(folder: &Path, line: &str) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_jointplay"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .env_remove("RUST_LOG")
        .output()
        .expect("the program starts")
}

fn read(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).expect("written")
}

#[test]
fn frames_of_a_film_equal_those_of_render() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let line = "render spcmm --duration 8ms --fps 10 --slow 100 --size 320x180 --quiet --hide trail";
    let output = jointplay(folder, &format!("{line} --out frames"));
    assert!(output.status.success());
    let file = |name: &str| jointplay::app::SaveFile { name: name.to_owned(), mime: "", bytes: read(folder, name) };
    for (name, magic) in [("a.mp4", &b"ftyp"[..]), ("a.gif", b"9a")] {
        let output = jointplay(folder, &format!("{line} --film {name}"));
        assert!(output.status.success(), "{name}");
        let film = read(folder, name);
        assert_eq!(&film[4..4 + magic.len()], magic);
        let metadata = read(folder, &format!("{name}.meta.json"));
        let metadata: serde_json::Value = serde_json::from_slice(&metadata).expect("JSON");
        let checksum = format!("{:08x}", crc32fast::hash(&film));
        assert_eq!(metadata["film_crc32"], checksum.as_str());
        let frames = metadata["frames"].as_array().expect("a list");
        assert_eq!(frames.len(), 9);
        let manifest = read(folder, "frames/manifest.json");
        let manifest: serde_json::Value = serde_json::from_slice(&manifest).expect("JSON");
        for (k, frame) in frames.iter().enumerate() {
            let (_, pixels) = decoded(&file(&format!("frames/frame_{k:05}.png")));
            let checksum = format!("{:08x}", crc32fast::hash(&pixels));
            assert_eq!(frame["pixels_crc32"], checksum.as_str(), "{name} {k}");
            for key in ["time_s", "state_hash"] {
                assert_eq!(frame[key], manifest["frames"][k][key], "{name} {k}");
            }
        }
    }
    // Existing files are not overwritten, and a failed film leaves no file.
    let before = std::fs::read_dir(folder).expect("a folder").count();
    for (options, words) in [
        ("--film a.mp4", "already exists"),
        ("--film a.avi", ".mp4 or .gif"),
        ("--film b.mp4 --size 321x180", "must be even"),
        ("--film b.gif --fps 60", "50 frames a second"),
    ] {
        let line = line.replace("--size 320x180 ", "").replace("--fps 10 ", "");
        let rest = if options.contains("--size") { "--fps 10" } else { "--size 320x180" };
        let fps = if options.contains("--fps") || rest == "--fps 10" { "" } else { "--fps 10" };
        let output = jointplay(folder, &format!("{line} {rest} {fps} {options}"));
        assert!(!output.status.success(), "{options}");
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.contains(words), "{options}: {message}");
    }
    assert_eq!(std::fs::read_dir(folder).expect("a folder").count(), before);
}

#[test]
fn the_window_makes_a_film_of_the_timeline_and_returns_to_its_instant() {
    let (mut harness, calls) = window("pendulum", [900.0, 640.0]);
    give_graphics(&mut harness);
    harness.state_mut().player_mut().pacer.set_scale(0.02);
    harness.state_mut().player_mut().run_to(30e-3);
    harness.run();
    let state = |harness: &egui_kittest::Harness<'_, jointplay::app::App>| {
        let player = harness.state().player();
        (player.pacer.shown(), player.reached(), player.simulation().state_hash(), player.pacer.scale())
    };
    let before = state(&harness);

    // Otherwise the arrows of a film have the scale of the run, and those of a picture that of recent forces.
    click(&mut harness, "View options");
    click(&mut harness, "Automatic scale");
    harness.key_press(eframe::egui::Key::Escape);
    harness.run();

    // A cancelled film leaves no file.
    click(&mut harness, "Save");
    click(&mut harness, "Film…");
    let words = label(&harness, "46 frames, 1.5 s of film");
    assert!(words, "30 ms at 1:50 and 30 frames a second");
    click(&mut harness, "Make film");
    harness.run_steps(5);
    assert!(harness.state().filming().is_some());
    // During filming nothing else may move the machine.
    harness.key_press(eframe::egui::Key::Space);
    harness.step();
    assert!(!harness.state().player().is_playing());
    click(&mut harness, "Cancel");
    assert_eq!(harness.state().filming(), None);
    assert!(calls.borrow().saved.is_empty());
    assert_eq!(state(&harness), before);

    click(&mut harness, "Save");
    click(&mut harness, "Film…");
    for (name, choice) in
        [("Size of the film", "640 × 360"), ("Frames of the film", "15 a second"), ("Time scale of the film", "1:20")]
    {
        harness.get_by_role_and_label(Role::ComboBox, name).click();
        harness.run_steps(2);
        click(&mut harness, choice);
    }
    assert!(label(&harness, "10 frames, 0.7 s of film"));
    click(&mut harness, "Make film");
    let file = next_file(&mut harness, &calls);
    assert_eq!((file.name.as_str(), file.mime), ("pendulum.mp4", "video/mp4"));
    assert_eq!(state(&harness), before);
    let frames = decode(&file.bytes, [640, 360]);
    assert_eq!(frames.len(), 10);

    // Each frame equals the picture of its instant.
    click(&mut harness, "Save");
    click(&mut harness, "Own size");
    for (name, edge) in [("Width of the picture", 640.0), ("Height of the picture", 360.0)] {
        harness.get_by_role_and_label(Role::SpinButton, name).set_value_accesskit(edge);
        harness.run_steps(2);
    }
    harness.key_press(eframe::egui::Key::Escape);
    harness.run_steps(2);
    for k in [0_usize, 4, 9] {
        harness.state_mut().player_mut().go_to(k as f64 / 15.0 / 20.0);
        harness.run();
        click(&mut harness, "Save");
        click(&mut harness, "Picture…");
        let (_, rgba) = decoded(&next_file(&mut harness, &calls));
        let picture: Vec<u8> = rgba.chunks_exact(4).flat_map(|pixel| pixel[..3].to_vec()).collect();
        let ratio = |k: usize| signal_to_noise(&picture, &frames[k].2);
        // The tolerance covers the trail and the fading impact marks, which only a film has, and names, which keep their places.
        assert!(ratio(k) > 25.0, "{k}: {}", ratio(k));
        let other = if k == 9 { 0 } else { 9 };
        assert!(ratio(k) > ratio(other) + 1.0, "{k}: {} {}", ratio(k), ratio(other));
    }
}
