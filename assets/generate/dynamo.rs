//! A small electric generator with exposed parts (Figure 11). Its shaft lies along Z, drawn in millimetres; the drive
//! end faces +Z and y = 0 is the ground.

use glam::{DVec2, DVec3};

use crate::gears;
use crate::mesh::{Polygons, Solid, polar};
use crate::outline::{Outline, circle, rounded_rectangle};
use crate::solids::{Station, beveled, bezier, extrude, lathe, rounded, sweep, tube};

/// Height of the shaft above the ground.
const SHAFT: f64 = 92.0;

/// All parts: file name, mesh in metres.
pub fn parts() -> Vec<(&'static str, Polygons)> {
    let mut parts = Vec::new();
    let mut add = |name, solid: Solid, crease| parts.push((name, solid.smoothed(crease).scaled(0.001)));
    add("dynamo_housing", housing(), 30.0);
    add("dynamo_end_bell", end_bell(), 34.0);
    add("dynamo_coil", coil(), 60.0);
    add("dynamo_shaft", shaft(), 30.0);
    add("dynamo_pulley", pulley(), 30.0);
    add("dynamo_bolt", bolt(), 30.0);
    add("dynamo_terminal_box", terminal_box(), 34.0);
    add("dynamo_cable", cable(), 60.0);
    add("dynamo_skid", skid(), 30.0);
    parts
}

fn about_z(profile: &[(f64, f64)], segments: u32) -> Solid {
    let points: Vec<DVec2> = profile.iter().map(|&p| DVec2::from(p)).collect();
    lathe(&points, segments).rotated(0, 90.0)
}

/// A finned tube along Z about the origin, with its feet.
fn housing() -> Solid {
    const FINS: u32 = 40;
    let mut outer = Vec::new();
    for i in 0..FINS {
        let axis = 360.0 * f64::from(i) / f64::from(FINS);
        // (radius, degrees from the fin's axis): root fillets, flanks, a round tip.
        let half =
            [(62.0, 4.5), (62.0, 3.0), (62.7, 2.0), (64.0, 1.55), (71.2, 1.15), (71.9, 0.75), (72.2, 0.25)];
        outer.extend(half.iter().map(|&(r, a)| polar(r, axis - a)));
        outer.extend(half.iter().rev().skip(1).take(5).map(|&(r, a)| polar(r, axis + a)));
    }
    let outline = Outline::new(outer).with_hole(circle(DVec2::ZERO, 54.0, 96));
    let mut solid = extrude(&outline, &beveled(-58.0, 58.0, 0.7));
    for side in [-1.0, 1.0] {
        let foot = Outline::new(rounded_rectangle(30.0, 116.0, 4.0, 6));
        let foot = extrude(&foot, &rounded(0.0, 9.0, 2.0, 4)).rotated(0, -90.0);
        solid.append(&foot.translated(side * 52.0, 8.0 - SHAFT, 0.0));
        for z in [-40.0, 0.0, 40.0] {
            // A rib from the foot to the tube.
            let rib = [(26.0, -84.0), (64.0, -84.0), (64.0, -79.0), (48.0, -42.0), (40.0, -46.0)];
            let mut rib: Vec<DVec2> = rib.map(DVec2::from).to_vec();
            for p in &mut rib {
                p.x *= side;
            }
            solid.append(&extrude(&Outline::new(rib), &beveled(z - 4.0, z + 4.0, 0.6)));
        }
    }
    solid
}

/// The cover of an end, with openings over the windings; the outside faces +Z, the seat is at z = 0.
fn end_bell() -> Solid {
    let mut face = Outline::new(circle(DVec2::ZERO, 52.0, 96));
    for window in gears::windows(20.0, 47.0, 6, 7.0, 5.0) {
        face = face.with_hole(window);
    }
    let mut solid = extrude(&face, &rounded(16.0, 21.0, 1.2, 3));
    let mut wall =
        vec![(53.9, -4.0), (53.9, 0.0), (66.0, 0.0), (66.6, 0.6), (66.6, 5.4), (66.0, 6.0), (58.0, 6.0)];
    wall.extend(bezier([(58.0, 6.0), (54.4, 6.0), (56.0, 20.8), (51.6, 21.0)], 10).map(|p| (p.x, p.y)));
    wall.extend([(49.5, 21.0), (49.5, 0.0), (51.0, -4.0), (53.9, -4.0)]);
    solid.append(&about_z(&wall, 120));
    let mut hub = vec![(9.0, 10.0), (19.0, 10.0), (19.0, 24.0)];
    hub.extend(bezier([(19.0, 24.0), (19.0, 28.0), (16.0, 27.0), (15.6, 31.0)], 8).map(|p| (p.x, p.y)));
    hub.extend([(15.0, 31.6), (9.6, 31.6), (9.0, 31.0), (9.0, 10.0)]);
    solid.append(&about_z(&hub, 72));
    // Ears for the tie bolts.
    for i in 0..6 {
        let at = polar(60.5, 60.0 * f64::from(i) + 30.0);
        let ear = Outline::new(circle(DVec2::ZERO, 6.0, 32));
        solid.append(&extrude(&ear, &rounded(5.0, 9.0, 1.0, 3)).translated(at.x, at.y, 0.0));
    }
    solid
}

/// A winding: a bundle of wires bent to a flat loop about X, to be placed around Z.
fn coil() -> Solid {
    let mut solid = Solid::default();
    for (dy, dx) in
        [(0.0, 0.0), (0.0, 2.1), (0.0, -2.1), (1.9, 1.05), (1.9, -1.05), (-1.9, 1.05), (-1.9, -1.05)]
    {
        const STEPS: usize = 48;
        let at = |i: usize| {
            let p = polar(1.0, 360.0 * i as f64 / STEPS as f64);
            DVec3::new(p.x * (7.4 + dx), p.y * (10.5 + dx), dy)
        };
        let path: Vec<Station> = (0..STEPS)
            .map(|i| {
                let tangent = (at(i + 1) - at(i + STEPS - 1)).normalize();
                Station { origin: at(i), x: tangent.cross(DVec3::Z), y: DVec3::Z }
            })
            .collect();
        // The cross-section's axes are (outwards, up), which is clockwise seen along the path.
        let section: Vec<DVec2> = circle(DVec2::ZERO, 1.1, 8).into_iter().rev().collect();
        solid.append(&sweep(&path, &section, true, 1.0));
    }
    solid
}

fn shaft() -> Solid {
    let mut profile =
        vec![(0.0, -96.0), (7.4, -96.0), (8.0, -95.4), (8.0, -60.0), (30.0, -60.0), (30.0, 60.0)];
    profile.extend([(8.8, 60.0), (8.8, 96.0), (8.0, 97.0), (8.0, 134.0), (7.0, 135.0), (0.0, 135.0)]);
    about_z(&profile, 64)
}

/// A pulley with two V grooves, its hub towards −Z, 30 mm wide about z = 0.
fn pulley() -> Solid {
    let mut profile = vec![(8.0, -22.0), (15.0, -22.0), (15.6, -21.4), (15.6, -12.0), (36.0, -12.0)];
    profile.extend([(37.0, -13.0), (43.4, -13.0), (44.0, -12.4), (44.0, -10.6), (36.0, -8.0), (36.0, -4.4)]);
    profile.extend([(44.0, -1.8), (44.0, 1.8), (36.0, 4.4), (36.0, 8.0), (44.0, 10.6), (44.0, 12.4)]);
    profile.extend([(43.4, 13.0), (37.0, 13.0), (35.5, 10.0), (16.0, 8.0), (15.6, 14.0), (15.0, 14.6)]);
    profile.extend([(8.0, 14.6), (8.0, -22.0)]);
    about_z(&profile, 96)
}

/// A hexagon bolt with its washer; the head stands on z = 0.
fn bolt() -> Solid {
    let mut solid = about_z(&[(0.0, -1.0), (5.6, -1.0), (5.6, 0.7), (5.2, 1.1), (0.0, 1.1)], 32);
    let hexagon = Outline::new(circle(DVec2::ZERO, 4.9, 6));
    solid.append(&extrude(&hexagon, &[(0.0, 1.1), (0.0, 4.2), (0.7, 4.7)]));
    solid.append(&about_z(&[(0.0, 4.6), (3.6, 4.6), (3.3, 5.0), (0.0, 5.0)], 32));
    solid
}

/// The box on top where the cables arrive; its underside is at y = 0.
fn terminal_box() -> Solid {
    let body = Outline::new(rounded_rectangle(56.0, 74.0, 5.0, 8));
    let lid = Outline::new(rounded_rectangle(60.0, 78.0, 6.0, 8));
    let mut solid = extrude(&body, &beveled(-14.0, 26.0, 0.5));
    solid.append(&extrude(&lid, &rounded(26.0, 33.0, 2.2, 4)));
    let mut solid = solid.rotated(0, -90.0);
    for z in [-20.0, 0.0, 20.0] {
        // Cable glands on the +X side.
        let profile =
            [(0.0, 27.0), (7.4, 27.0), (7.4, 31.0), (6.0, 31.6), (6.0, 37.0), (5.4, 38.0), (0.0, 38.0)];
        let points: Vec<DVec2> = profile.iter().map(|&p| DVec2::from(p)).collect();
        solid.append(&lathe(&points, 6).rotated(2, -90.0).translated(0.0, 13.0, z));
    }
    solid
}

/// A cable from a gland (at the origin, going +X) down to the ground 150 mm below.
fn cable() -> Solid {
    let ends = [
        [(0.0, 0.0), (34.0, 2.0), (38.0, -30.0), (40.0, -70.0)],
        [(40.0, -70.0), (42.0, -120.0), (46.0, -148.0), (90.0, -150.0)],
        [(90.0, -150.0), (140.0, -152.0), (170.0, -150.0), (260.0, -150.0)],
    ];
    let mut path = vec![DVec3::ZERO];
    for curve in ends {
        path.extend(bezier(curve, 24).map(|p| {
            let sway = (p.x - 60.0).max(0.0) / 200.0;
            DVec3::new(p.x, p.y, 40.0 * sway * sway)
        }));
    }
    tube(&path, DVec3::Z, 4.0, 16)
}

/// Two rails and the cross-bars that carry them; the top is at y = 8.
fn skid() -> Solid {
    let mut solid = Solid::default();
    for side in [-52.0, 52.0] {
        let rail = Outline::new(rounded_rectangle(36.0, 190.0, 3.0, 4));
        solid
            .append(&extrude(&rail, &rounded(0.0, 8.0, 1.0, 3)).rotated(0, -90.0).translated(side, 0.0, 0.0));
    }
    for z in [-78.0, 78.0] {
        let bar = Outline::new(rounded_rectangle(150.0, 22.0, 3.0, 4));
        solid.append(&extrude(&bar, &rounded(0.5, 6.0, 1.0, 3)).rotated(0, -90.0).translated(0.0, 0.0, z));
    }
    solid
}
