//! The embedded window, and the menu entry that copies its markup.

use eframe::egui::{OutputCommand, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::{App, AppOptions, DesktopHost, Verdict};

use crate::hands::page::{click, label, open, verdict, window};

const FRAME: [f32; 2] = [700.0, 500.0];
const SLIDERS: [&str; 3] = ["Clearance", "Friction coefficient", "Restitution"];

fn open_embedded(link: &str) -> Harness<'static, App> {
    open(AppOptions::from_link(link).expect("a link"), FRAME).0
}

#[test]
fn embed_shows_only_the_picture_and_the_named_panels_and_is_kept_in_links() {
    for (words, sliders, timeline, plots, bench) in [
        ("", false, false, false, false),
        ("controls,timeline", true, true, false, false),
        ("plots,bench", false, false, true, true),
    ] {
        let mut harness = open_embedded(&format!("?embed={words}&scene=pendulum&play=0"));
        harness.get_by_role_and_label(Role::Button, "Play");
        harness.get_by_label("3D view");
        for hidden in ["Save", "Open", "Copy link", "View options", "Scene"] {
            assert!(harness.query_by_label(hidden).is_none(), "{words}: {hidden} is shown");
        }
        for (role, name, shown) in [
            (Role::Slider, SLIDERS[0], sliders),
            (Role::Slider, SLIDERS[1], sliders),
            (Role::Slider, SLIDERS[2], sliders),
            (Role::Slider, "Timeline, s", timeline),
        ] {
            assert_eq!(harness.query_by_role_and_label(role, name).is_some(), shown, "{words}: {name}");
        }
        for (name, shown) in [("Normal force, N", plots), ("Phase portrait and Poincaré section", bench)] {
            assert_eq!(harness.query_by_label(name).is_some(), shown, "{words}: {name}");
        }
        let link = harness.state().share_state();
        let parameter = format!("embed={}", words.replace(',', "%2C"));
        assert!(link.split('&').any(|pair| pair == parameter), "{link}");
        if sliders {
            harness.get_by_role_and_label(Role::Slider, "Clearance").set_value_accesskit(0.45);
            harness.run_steps(2);
            assert_eq!(harness.state().player().pending().machine.contact.clearance, 0.45e-3);
        }
    }
    let error = AppOptions::from_link("?embed=sliders").expect_err("no panel");
    let words = "no panel `sliders`; allowed, separated by commas: controls, timeline, plots, bench";
    assert!(error.contains(words), "{error}");
}

/// The text that a click on `Embed` copies to the clipboard.
fn copied_markup(harness: &mut Harness<'_, App>) -> Option<String> {
    click(harness, "Save");
    harness.get_by_label("Embed").click();
    (0..3).find_map(|_| {
        harness.step();
        let commands = &harness.output().platform_output.commands;
        commands.iter().find_map(|command| match command {
            OutputCommand::CopyText(text) => Some(text.clone()),
            _ => None,
        })
    })
}

#[test]
fn the_embedding_markup_opens_the_same_state_with_its_sliders() {
    let (mut harness, _) = window("pendulum", [1280.0, 800.0]);
    harness.state_mut().player_mut().set("contact.clearance", "0.5 mm").expect("in range");
    harness.state_mut().player_mut().run_to(10e-3);
    harness.run();
    let markup = copied_markup(&mut harness).expect("copied");
    let start = "<iframe src=\"https://example.org/lab/#scene=pendulum&amp;";
    assert!(markup.starts_with(start) && markup.ends_with("></iframe>"), "{markup}");
    assert!(markup.contains("title=\"Pendulum on a ball joint\""), "{markup}");
    let link = markup.split('"').nth(1).expect("an address").replace("&amp;", "&");
    let mut embedded = open_embedded(&link);
    let hash = harness.state().player().simulation().state_hash();
    assert_eq!(verdict(&mut embedded), Verdict::Agrees(hash));
    for name in SLIDERS {
        embedded.get_by_role_and_label(Role::Slider, name);
    }

    // Without a page, the message states how to set one.
    harness.state_mut().set_host(Box::new(DesktopHost::default()));
    assert_eq!(copied_markup(&mut harness), None);
    assert!(label(&harness, "set one with --page or JOINTPLAY_PAGE"));
}
