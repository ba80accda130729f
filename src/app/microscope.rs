//! The microscope: magnifies one joint with play beside the 3D view until its play is visible.

mod draw;
mod friction;
mod magnified_joint;
mod pin;
mod slide;

use eframe::egui::{self, Grid, Panel, RichText, Role, ScrollArea, Sense, TextStyle, Ui, WidgetInfo, vec2};
use glam::Vec3;

use super::keys::Action;
use super::paths::{Point, of_clearance};
use super::player::Player;
use super::run::Run;
use super::{layout, sound, spoken, theme, value};
use crate::machine::LooseKind;
use crate::simulate::ContactMode;
pub use draw::Circle;
use draw::{Plane, Sheet};
pub use friction::{CurvePoint, FrictionCurve, FrictionScale};
use magnified_joint::MagnifiedJoint;

/// Least width and height, points.
const MIN_SIZE: egui::Vec2 = vec2(200.0, 150.0);
/// Initial fraction of the picture, and upper limit, points.
const INITIAL_FRACTION: f32 = 0.4;
const MAX_INITIAL_SIDE: f32 = 330.0;
/// Largest fraction of the picture.
const MAX_FRACTION: f32 = 0.5;
/// Width of a window below which it is that of an upright phone, points.
const PHONE_WIDTH: f32 = 480.0;
/// Least remainder of the picture, points; the microscope stays hidden if there is less.
const MIN_REMAINDER: f32 = 120.0;
/// Height of the section of the contact, and least height in a low panel, points.
const SECTION_HEIGHT: f32 = 112.0;
const MIN_SECTION_HEIGHT: f32 = 76.0;
/// Height of the panel from which it has the diagram of friction, points.
const MIN_HEIGHT_WITH_FRICTION: f32 = 180.0;
/// Width from which pictures and numbers are side by side, points.
const MIN_WIDTH_SIDE_BY_SIDE: f32 = 430.0;
/// Least side of a phone's picture with the choice of the plane in sight below it, points.
const MIN_SIDE_ABOVE_CHOICE: f32 = 160.0;
/// Least side of the picture for which the diagram of friction is in sight below it, points.
const MIN_SIDE_ABOVE_FRICTION: f32 = 140.0;
/// Width of the numbers beside the pictures, points.
const NUMBERS_WIDTH: f32 = 215.0;
/// Least reference speed of the velocity arrow, m/s.
const MIN_REFERENCE_SPEED: f64 = 1e-4;

/// State of the panel.
#[derive(Default)]
pub struct Microscope {
    open: bool,
    joint: usize,
    plane: Plane,
    circle: Option<Circle>,
    friction: Option<(FrictionCurve, FrictionScale)>,
}

impl Microscope {
    /// Whether it is shown.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// Opens or closes it.
    pub fn set_open(&mut self, open: bool) {
        self.open = open;
    }

    /// The joint in focus, by index.
    pub fn joint(&self) -> usize {
        self.joint
    }

    /// Selects the joint in focus.
    pub fn focus(&mut self, joint: usize) {
        self.joint = joint;
    }

    /// Clearance circle of the last drawing; `None` if no joint with clearance was drawn.
    pub fn circle(&self) -> Option<Circle> {
        self.circle
    }

    /// Friction over sliding, as last drawn; `None` if it was not.
    pub fn friction(&self) -> Option<&(FrictionCurve, FrictionScale)> {
        self.friction.as_ref()
    }

    /// The panel, beside the picture or below it in a tall `ui`; `view`: world vectors to the right and up in the 3D view.
    /// Returns the joint selected in it.
    fn ui(&mut self, ui: &mut Ui, player: &Player, view: [Vec3; 2]) -> Option<usize> {
        self.circle = None;
        self.friction = None;
        let room = ui.available_size();
        let (room, least, panel) = if room.x > room.y {
            (room.x, MIN_SIZE.x, Panel::right("microscope"))
        } else {
            (room.y, MIN_SIZE.y, Panel::bottom("microscope below"))
        };
        if !self.open || room < least + MIN_REMAINDER {
            // Keeps the picture's automatic ID.
            ui.skip_ahead_auto_ids(1);
            return None;
        }
        let size = (INITIAL_FRACTION * room).min(MAX_INITIAL_SIDE).max(least);
        let panel = panel.default_size(size).size_range(least..=(MAX_FRACTION * room).max(least));
        let shown = panel
            .resizable(true)
            .frame(theme::panel(ui).inner_margin(8.0))
            .show(ui, |ui| self.contents(ui, player, view));
        for panel in ["microscope", "microscope below"] {
            spoken::splitter(ui, panel, "Size of the microscope");
        }
        shown.inner
    }

    fn contents(&mut self, ui: &mut Ui, player: &Player, view: [Vec3; 2]) -> Option<usize> {
        let joints = &player.running().machine.loose_joints;
        self.joint = self.joint.min(joints.len().saturating_sub(1));
        let mut joint = self.joint;
        // On a phone the circle needs the height, and the plane is chosen below it.
        let is_narrow = theme::has_fingers(ui) && ui.ctx().content_rect().width() < PHONE_WIDTH;
        ui.horizontal_wrapped(|ui| {
            if ui.available_width() > 300.0 {
                spoken::heading(&ui.label(RichText::new("Microscope").strong()), "Microscope");
            }
            let help = "Joint in focus (a click on it, or keys 5 to 9)";
            let name = |index: usize| joints.get(index).map_or("", |joint| &joint.name);
            layout::choice(ui, ["Joint in focus", help], Some(54.0), &mut joint, 0..joints.len(), name);
            if !is_narrow {
                self.plane_choice(ui);
            }
            let close = ui.button("Close").on_hover_text("Esc, or key L");
            if close.clicked() {
                self.open = false;
            }
        });
        let chosen = (joint != self.joint).then_some(joint);
        self.joint = joint;
        let Some(magnified) = MagnifiedJoint::of(player, self.joint) else {
            ui.label("This scene has no joint with play");
            return chosen;
        };
        let space = ui.available_size();
        let axes = self.plane.axes(player.running().view.down, view);
        let has_friction = self.has_friction(player, space.y);
        if space.x >= MIN_WIDTH_SIDE_BY_SIDE && space.x > space.y {
            ui.horizontal_top(|ui| {
                let side = (space.x - NUMBERS_WIDTH - 8.0).min(space.y).max(96.0);
                self.picture(ui, player, &magnified, axes, vec2(side, side));
                ui.vertical(|ui| {
                    scrolled(ui, |ui| {
                        let mut left = space.y;
                        if magnified.has_section() {
                            section(ui, &magnified, SECTION_HEIGHT);
                            left -= SECTION_HEIGHT + ui.spacing().item_spacing.y;
                        }
                        self.below_pictures(ui, player, &magnified, (axes, has_friction.then_some(left)));
                    });
                });
            });
        } else {
            scrolled(ui, |ui| {
                let width = ui.available_width();
                let gap = ui.spacing().item_spacing.y;
                // The state of the contact stays in sight, then the diagram of friction if the circle leaves it room.
                let state = ui.text_style_height(&TextStyle::Body) + gap;
                let section_height = if magnified.has_section() { MIN_SECTION_HEIGHT + gap } else { 0.0 };
                let below = section_height + state + friction::MIN_HEIGHT + 2.0 * gap;
                let reserves = has_friction && space.y - below >= MIN_SIDE_ABOVE_FRICTION;
                let side = if is_narrow {
                    // The choice below is shown whole or is scrolled to: a strip of it would look like a mistake.
                    let choice = ui.spacing().interact_size.y + gap;
                    let above = space.y - choice;
                    if above >= MIN_SIDE_ABOVE_CHOICE { width.min(above) } else { space.y }
                } else {
                    let largest = draw::side(vec2(width, space.y), 150.0);
                    if reserves { largest.min(space.y - below) } else { largest }
                };
                self.picture(ui, player, &magnified, axes, vec2(width, side));
                if is_narrow {
                    self.plane_choice(ui);
                }
                let mut left = space.y - side - gap;
                if magnified.has_section() {
                    let most = if reserves { left - (below - section_height) } else { left };
                    let height = most.clamp(MIN_SECTION_HEIGHT, SECTION_HEIGHT);
                    section(ui, &magnified, height);
                    left -= height + gap;
                }
                self.below_pictures(ui, player, &magnified, (axes, has_friction.then_some(left)));
            });
        }
        chosen
    }

    /// What is below the pictures, with the diagram of friction in `room`, points, if there is one: above the numbers if it fits there.
    fn below_pictures(
        &mut self,
        ui: &mut Ui,
        player: &Player,
        magnified: &MagnifiedJoint,
        (axes, room): ([Vec3; 2], Option<f32>),
    ) {
        let top = ui.cursor().top();
        ui.label(RichText::new(value::contact(magnified.report.state, magnified.kind.parts()[0])).strong());
        let room = room.map(|room| room - (ui.cursor().top() - top));
        let fits = room.is_some_and(|room| room >= friction::MIN_HEIGHT);
        let height = room.map(|room| room.clamp(friction::MIN_HEIGHT, friction::HEIGHT));
        if let Some(height) = height.filter(|_| fits) {
            self.friction = friction::diagram(ui, player, magnified, (self.joint, height));
        }
        numbers(ui, player, magnified, axes);
        if let Some(height) = height.filter(|_| !fits) {
            self.friction = friction::diagram(ui, player, magnified, (self.joint, height));
        }
    }

    fn plane_choice(&mut self, ui: &mut Ui) {
        let help = "Plane of the picture, seen along its normal: as the 3D view, or that of two world axes";
        let names = ["Plane of the microscope", help];
        layout::choice(ui, names, Some(54.0), &mut self.plane, Plane::ALL, Plane::label);
    }

    /// Whether the diagram of friction is shown in a panel `height` points high: not in a low one, and not without friction.
    fn has_friction(&self, player: &Player, height: f32) -> bool {
        let joint = player.running().machine.loose_joints.get(self.joint);
        height >= MIN_HEIGHT_WITH_FRICTION && joint.is_some_and(|joint| friction::is_shown(&joint.contact))
    }

    /// The picture of the play.
    fn picture(&mut self, ui: &mut Ui, player: &Player, magnified: &MagnifiedJoint, axes: [Vec3; 2], size: egui::Vec2) {
        let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
        let report = &magnified.report;
        let words = magnified.in_words();
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &words));
        if report.state == ContactMode::Ideal {
            draw::empty(ui, rect, "An ideal joint has no clearance and shows no play");
            return;
        }
        let sheet = Sheet::new(ui, rect, magnified);
        let now = player.pacer.shown();
        // An older part would leave the present clearance, or never reach it.
        let path = |number: usize| {
            let since = player.paths().between(self.joint, number, magnified.since, now);
            of_clearance(since, magnified.report.clearance)
        };
        let help = match magnified.kind {
            LooseKind::Pin(kind) if kind.length.is_some() => pin::draw(&sheet, &kind, axes, [0, 1].map(path), now),
            LooseKind::Slide(kind) => slide::draw(&sheet, &kind, path(0), now),
            LooseKind::Ball | LooseKind::Pin(_) => self.circle_of(&sheet, path(0), now, axes),
        };
        let worn = if magnified.walls.is_empty() { "" } else { " The faint circle is the clearance without wear." };
        response.on_hover_text(format!("{help}{worn}"));
    }

    /// The clearance circle of a joint that touches at one place.
    fn circle_of(&mut self, sheet: &Sheet<'_>, path: &[Point], now: f64, axes: [Vec3; 2]) -> &'static str {
        let magnified = sheet.magnified();
        let approach = magnified.impact.map_or(0.0, |impact| impact.approach_speed);
        let fastest = magnified.sliding.unwrap_or(magnified.velocity).norm();
        let speed = draw::round_up(approach.max(fastest).max(MIN_REFERENCE_SPEED));
        if magnified.kind == LooseKind::Ball {
            self.circle = Some(draw::sphere(sheet, axes, path, now, speed));
            return "The outline is how far the ball's centre can go; it leaves that only by the penetration. The path, seen from \
                    the socket, covers the latest six impacts since the clearance last changed, and fades with age (recorded for the \
                    first 12 joints). In contact the dot is orange, and wall and normal are shown. The arrow is the velocity of the ball's \
                    centre, in contact the sliding velocity of the friction law.";
        }
        self.circle = Some(draw::sphere(sheet, pin::across(magnified, axes), path, now, speed));
        "Section across the pin's axis. The outline is how far the middle of the pin can go; it leaves that only by the \
         penetration. The path covers the latest six impacts since the clearance last changed, and fades with age \
         (recorded for the first 12 joints). In contact the dot is orange, and wall and normal are shown. The arrow is the velocity of the pin's middle."
    }
}

fn scrolled(ui: &mut Ui, add: impl FnOnce(&mut Ui)) {
    // Scrolls sideways, too: a long number must not widen the panel.
    ScrollArea::both().id_salt("under the microscope").auto_shrink(false).show(ui, |ui| {
        // Space for the scroll bar.
        ui.set_max_width(ui.available_width() - 10.0);
        add(ui);
    });
}

/// The picture of the contact, `height` points high.
fn section(ui: &mut Ui, magnified: &MagnifiedJoint, height: f32) {
    let size = vec2(ui.available_width(), height);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let Some(patch) = &magnified.patch else {
        draw::empty(ui, rect, "No contact patch");
        return;
    };
    let words = if patch.penetration > 0.0 {
        let pressed = draw::length(patch.penetration, 3);
        let radius = patch.radius.map(|radius| format!(", patch of radius {}", draw::length(radius, 3)));
        format!("Section of the contact: {pressed} deep{}", radius.unwrap_or_default())
    } else {
        let gap = draw::length(-patch.penetration, 3);
        format!("Section of the contact: a gap of {gap}")
    };
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &words));
    draw::section(&Sheet::new(ui, rect, magnified), patch);
    response.on_hover_text(
        "Both parts as they would lie without pressing each other, about the point of contact: the gap grows as x²/2R, \
         R = (r + c) r / c. The overlap is taken up elastically over the contact patch, the thick line, of radius \
         a = √(R δ) by Hertz. The scale follows the latest impact's depth.",
    );
}

/// Numeric values of the pictures' contents.
fn numbers(ui: &mut Ui, player: &Player, magnified: &MagnifiedJoint, axes: [Vec3; 2]) {
    const NONE: &str = "—";
    let report = &magnified.report;
    let speed = |si: f64| value::quantity(si, "m/s", 3);
    let towards = crate::view::to_f32(&report.eccentricity).dot(axes[0].cross(axes[1]));
    let [part, wall] = magnified.kind.parts();
    let (gap, indentation) = match magnified.penetration() {
        Some(depth) if depth > 0.0 => (NONE.to_owned(), value::quantity(depth, "um", 3)),
        Some(depth) => (draw::length(-depth, 3), NONE.to_owned()),
        None => (NONE.to_owned(), NONE.to_owned()),
    };
    let radius = magnified.patch.and_then(|patch| patch.radius);
    let eccentricity = draw::length(report.eccentricity.norm(), 4);
    let mut rows = vec![("Eccentricity", eccentricity, format!("Distance of the {part}'s centre from the {wall}'s"))];
    if magnified.kind == LooseKind::Ball {
        let help = "Its component along the line of sight, which the picture does not show";
        rows.push(("Towards the eye", draw::length(f64::from(towards), 3), help.to_owned()));
    } else if magnified.tilts() {
        let help = format!("Angle of the {part}'s axis to the {wall}'s");
        rows.push(("Tilt", value::quantity(report.tilt, "deg", 3), help));
        let help = format!("Displacement of the {part} along the {wall}'s axis");
        rows.push(("Axial position", draw::length(report.axial, 4), help));
    }
    rows.push(("Gap", gap, format!("Between {part} and wall, where they are nearest")));
    rows.push(("Indentation", indentation, format!("How deep the {part} presses into the wall")));
    if magnified.has_section() {
        let help = "Radius of the contact patch by Hertz, a = √(R δ), R = (r + c) r / c";
        let radius = radius.map_or(NONE.to_owned(), |radius| format!("radius {}", draw::length(radius, 3)));
        rows.push(("Elastic patch", radius, help.to_owned()));
    }
    let approach = if magnified.penetration().is_some() { speed(report.penetration_rate) } else { NONE.to_owned() };
    let help = format!("Rate at which the {part} approaches the wall now; negative while it recedes");
    rows.push(("Speed of approach", approach, help));
    if magnified.kind == LooseKind::Ball {
        let sliding = magnified.sliding.map_or(NONE.to_owned(), |v| speed(v.norm()));
        rows.push(("Sliding", sliding, "Sliding speed in the friction law".to_owned()));
    }
    let help = format!("On the {part}; of an ideal joint the whole reaction");
    rows.push(("Normal force", value::quantity(report.normal_force.norm(), "N", 4), help));
    if report.lubricant_force.norm() > 0.0 {
        let help = format!("Force of the lubricant on the {part}");
        rows.push(("Lubricant force", value::quantity(report.lubricant_force.norm(), "N", 4), help));
    }
    let ratio = |number: f64| value::number(number, 4);
    let impact = magnified.impact;
    let formatted = |read: fn(&crate::simulate::Impact) -> String| impact.as_ref().map_or(NONE.to_owned(), read);
    let now = player.pacer.shown();
    let ago = impact.map_or(NONE.to_owned(), |impact| match now - impact.end {
        ago if ago < 0.0 => "under way".to_owned(),
        ago => format!("{} ago", value::time(ago)),
    });
    let latest = [
        ("Latest impact", ago, "When its contact ended"),
        (
            "Approach speed",
            formatted(|impact| value::quantity(impact.approach_speed, "m/s", 4)),
            "Speed of approach when the latest impact began",
        ),
        (
            "Separation speed",
            formatted(|impact| value::quantity(impact.separation_speed, "m/s", 4)),
            "Speed of separation when it ended",
        ),
        ("Deepest", formatted(|impact| value::quantity(impact.deepest, "um", 3)), "Its largest indentation"),
        (
            "Restitution set",
            impact.map_or(NONE.to_owned(), |impact| ratio(impact.requested)),
            "Coefficient of restitution set for the joint",
        ),
        (
            "Restitution by law",
            impact.map_or(NONE.to_owned(), |impact| ratio(impact.law)),
            "Restitution that the normal-force law gives an undisturbed impact",
        ),
        (
            "Measured",
            impact.map_or(NONE.to_owned(), |impact| ratio(impact.achieved())),
            "Speed of separation over speed of approach of the latest impact",
        ),
    ];
    Grid::new("numbers under the microscope").num_columns(2).spacing([10.0, 2.0]).min_row_height(16.0).show(ui, |ui| {
        let latest = latest.map(|(name, number, help)| (name, number, help.to_owned()));
        for (name, number, help) in rows.into_iter().chain(latest) {
            let label = ui.label(RichText::new(name).small().weak());
            label.on_hover_text(help);
            ui.label(RichText::new(number).small());
            ui.end_row();
        }
    });
    let remark = match impact {
        Some(impact) if impact.below_speed_floor => {
            "It began slower than impact_speed_floor: it rebounds higher than set"
        }
        Some(impact) if impact.disturbed => {
            "Another joint was in contact meanwhile, or a parameter changed: the law alone does not set its restitution"
        }
        _ => "",
    };
    layout::reserve_lines(ui, "remark under the microscope", 3, |ui| {
        ui.label(RichText::new(remark).small());
    });
}

impl Run {
    /// Focuses joint `joint` if the scene has it: the view follows its centre.
    pub(super) fn focus(&mut self, joint: usize) {
        self.microscope.focus(joint);
        self.viewport.centre(&self.player, joint);
    }

    /// The microscope beside the picture, which gets the rest of `ui`.
    pub(super) fn microscope_beside(&mut self, ui: &mut Ui) {
        let view = self.viewport.picture_axes();
        if let Some(joint) = self.microscope.ui(ui, &self.player, view) {
            self.focus(joint);
        }
    }

    /// Instrument switches in the view menu; returns the action chosen among them. `sound`: whether impacts are heard.
    pub(super) fn instruments(&mut self, ui: &mut Ui, sound: bool) -> Option<Action> {
        let mut chosen = None;
        ui.label("Instruments");
        ui.horizontal(|ui| {
            ui.checkbox(&mut self.microscope.open, "Microscope")
                .on_hover_text("The play of the joint in focus, magnified: motion in it, contact, impacts (key L)");
            if sound::switch(ui, sound) {
                chosen = Some(Action::Sound);
            }
        });
        if self.ideal_switch(ui) {
            chosen = Some(Action::IdealGhost);
        }
        self.impact_list.switch(ui);
        chosen
    }
}
