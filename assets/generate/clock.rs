//! The parts of a skeleton mantel clock, each a file, so that each can have its own material; scenes assemble them (see
//! `train` for the places of the wheels). Drawn in millimetres, saved in metres. Plates and dial lie in XY and face +Z;
//! y = 0 is the table.

use glam::{DVec2, DVec3};

use crate::gears::{self, Wheel, meshing_turn, pitch_radius};
use crate::mesh::{Polygons, Solid, polar};
use crate::outline::{Outline, circle, contours, distance, rounded_rectangle};
use crate::solids::{Station, beveled, bezier, extrude, lathe, rounded, sweep};

/// The centre of the dial.
pub const CENTER: DVec2 = DVec2::new(0.0, 190.0);
/// The balance staff.
pub const BALANCE: DVec2 = DVec2::new(0.0, 84.0);
/// The pallet fork's pivot, on the line from the escape wheel to the balance.
pub const PALLETS: DVec2 = DVec2::new(-5.434, 103.573);

/// An arbor of the going train: its place, its wheel and its pinion.
pub struct Arbor {
    /// Its name.
    pub name: &'static str,
    /// Its place in the plane of the plates.
    pub at: DVec2,
    /// Teeth and module of its wheel, and its rotation in degrees.
    pub wheel: (u32, f64, f64),
    /// Leaves of its pinion, which the arbor before drives, and its rotation in degrees.
    pub pinion: (u32, f64),
}

/// The going train from the barrel to the escape wheel. Wheels and pinions mesh.
pub fn train() -> Vec<Arbor> {
    // Each step: name, direction from the arbor before, leaves driven, own wheel.
    let steps = [
        ("center", 130.0, 12, (80, 0.8)),
        ("third", 215.0, 10, (75, 0.7)),
        ("fourth", -75.0, 10, (70, 0.6)),
        ("escape", -60.0, 8, (15, 0.0)),
    ];
    let radius = pitch_radius(0.9, 84 + 12);
    let barrel = CENTER - polar(radius, 130.0);
    let mut arbors = vec![Arbor { name: "barrel", at: barrel, wheel: (84, 0.9, 0.0), pinion: (0, 0.0) }];
    for (name, direction, leaves, (teeth, module)) in steps {
        let driver = &arbors[arbors.len() - 1];
        let (driver_teeth, driver_module, driver_turn) = driver.wheel;
        let at = driver.at + polar(pitch_radius(driver_module, driver_teeth + leaves), direction);
        let turn = meshing_turn(driver_teeth, driver_turn, leaves, direction);
        // The wheel sits on the same arbor; any rotation would do.
        arbors.push(Arbor { name, at, wheel: (teeth, module, turn), pinion: (leaves, turn) });
    }
    arbors
}

/// All parts: file name, mesh in metres.
pub fn parts() -> Vec<(&'static str, Polygons)> {
    let mut parts = Vec::new();
    let mut add = |name, solid: Solid, crease| parts.push((name, solid.smoothed(crease).scaled(0.001)));
    let wheel = |module, teeth, rim, hub, spokes, spoke_width, half_thickness| {
        Wheel { module, teeth, rim, hub, spokes, spoke_width, half_thickness }.solid()
    };
    add("clock_great_wheel", wheel(0.9, 84, 3.2, 10.0, 6, 3.6, 1.5), 28.0);
    add("clock_center_wheel", wheel(0.8, 80, 2.6, 6.0, 5, 2.8, 1.1), 28.0);
    add("clock_third_wheel", wheel(0.7, 75, 2.3, 5.0, 5, 2.4, 1.0), 28.0);
    add("clock_fourth_wheel", wheel(0.6, 70, 2.0, 4.4, 4, 2.2, 0.9), 28.0);
    add("clock_escape_wheel", gears::escape_wheel(13.5, 0.8), 28.0);
    add("clock_pinion_12", gears::pinion(0.9, 12, 6.0), 28.0);
    add("clock_pinion_10", gears::pinion(0.75, 10, 5.0), 28.0);
    add("clock_pinion_8", gears::pinion(0.6, 8, 5.0), 28.0);
    add("clock_arbor", arbor(), 30.0);
    add("clock_barrel", barrel(), 30.0);
    add("clock_mainspring", spiral_ribbon(9.0, 25.5, 11.0, 0.8, 6.0), 40.0);
    add("clock_plate", plate().with_planar_uvs(80.0), 34.0);
    add("clock_pillar", pillar(), 30.0);
    add("clock_screw", screw(), 30.0);
    add("clock_chaton", chaton(), 50.0);
    add("clock_dial", dial(), 30.0);
    add("clock_bezel", bezel(), 40.0);
    add("clock_hour_hand", hand(42.0, 3.5, 2.4), 34.0);
    add("clock_minute_hand", hand(58.0, 2.7, 1.8), 34.0);
    add("clock_hand_cap", hand_cap(), 30.0);
    add("clock_balance", balance(), 30.0);
    add("clock_hairspring", spiral_ribbon(3.0, 14.5, 10.0, 0.22, 1.3), 40.0);
    add("clock_balance_cock", balance_cock().with_planar_uvs(80.0), 34.0);
    add("clock_pallet_fork", pallet_fork(), 34.0);
    add("clock_pallet_stone", pallet_stone(), 20.0);
    add("clock_base", base(), 34.0);
    add("clock_base_moulding", moulding(), 34.0);
    add("clock_foot", foot(), 40.0);
    add("clock_finial", finial(), 40.0);
    parts
}

/// A lathe profile about Z, front towards +Z.
fn turned(profile: &[(f64, f64)], segments: u32) -> Solid {
    let points: Vec<DVec2> = profile.iter().map(|&p| DVec2::from(p)).collect();
    lathe(&points, segments).rotated(0, 90.0)
}

/// An arbor from back plate to front plate, with pivots that end in the jewels.
fn arbor() -> Solid {
    let mut profile = vec![(0.0, -18.2), (0.7, -18.0), (0.7, -15.2), (1.5, -14.6), (1.6, -14.2)];
    profile.extend([(1.6, 14.2), (1.5, 14.6), (0.7, 15.2), (0.7, 18.0), (0.0, 18.2)]);
    turned(&profile, 24)
}

/// The drum that holds the mainspring, open in front behind a spoked lid.
fn barrel() -> Solid {
    let mut profile = vec![(0.0, -6.0), (29.5, -6.0), (30.0, -5.5), (30.0, 3.5), (29.5, 4.0)];
    profile.extend([(28.2, 4.0), (27.8, 3.6), (27.8, -4.0), (0.0, -4.0)]);
    let mut solid = turned(&profile, 96);
    let mut lid = Outline::new(circle(DVec2::ZERO, 27.75, 96));
    for window in gears::windows(8.5, 25.0, 3, 3.4, 2.5) {
        lid = lid.with_hole(window);
    }
    solid.append(&extrude(&lid, &beveled(2.4, 3.8, 0.3)));
    solid.append(&turned(&[(0.0, 3.8), (5.0, 3.8), (5.0, 5.2), (4.5, 5.7), (0.0, 5.7)], 48));
    solid
}

/// A flat spring coiled about Z: from radius `inner` to `outer` in `coils` turns.
fn spiral_ribbon(inner: f64, outer: f64, coils: f64, thickness: f64, height: f64) -> Solid {
    let steps = (coils * 56.0) as usize;
    let path: Vec<Station> = (0..=steps)
        .map(|i| {
            let t = i as f64 / steps as f64;
            // Slightly uneven, denser at the inside, like a real spring.
            let radius = inner + (outer - inner) * t * (0.85 + 0.15 * t);
            let outward = polar(1.0, 360.0 * coils * t).extend(0.0);
            Station { origin: outward * radius, x: -outward, y: DVec3::Z }
        })
        .collect();
    let (x, y) = (thickness / 2.0, height / 2.0);
    let section = [(-x, -y), (x, -y), (x, y), (-x, y)].map(DVec2::from);
    sweep(&path, &section, false, 1.0)
}

/// The places of the pillars between the plates.
pub fn pillar_places() -> [DVec2; 5] {
    [
        CENTER + polar(53.0, 90.0),
        CENTER + polar(53.0, 18.0),
        CENTER + polar(53.0, 162.0),
        DVec2::new(-50.0, 60.0),
        DVec2::new(50.0, 60.0),
    ]
}

/// A plate of openwork, 3 mm thick about z = 0, all of its inner corners filleted.
fn plate() -> Solid {
    let arbors = train();
    let at = |i: usize| arbors[i].at;
    let (barrel, third, fourth, escape) = (at(0), at(2), at(3), at(4));
    let pillars = pillar_places();
    let field = |p: DVec2| {
        use distance::{bar, curve, disc, ring, smooth_union};
        let mirrored = DVec2::new(p.x.abs(), p.y);
        let mut parts = vec![ring(p, CENTER, 53.0, 4.2)];
        parts.push(bar(p, CENTER, pillars[0], 3.6, 4.6));
        parts.push(bar(p, CENTER, third, 3.2, 3.4));
        parts.push(bar(p, third, CENTER + polar(53.0, 208.0), 3.4, 4.0));
        parts.push(bar(p, CENTER, barrel, 3.4, 4.4));
        parts.push(bar(p, barrel, CENTER + polar(53.0, -50.0), 4.4, 5.0));
        parts.push(curve(p, third, DVec2::new(-31.0, 150.0), fourth, 3.0));
        parts.push(curve(p, fourth, DVec2::new(-22.0, 126.0), escape, 3.0));
        parts.push(curve(p, escape, DVec2::new(4.0, 121.0), DVec2::new(33.0, 112.0), 3.0));
        parts.push(curve(p, escape, DVec2::new(-18.0, 121.0), DVec2::new(-33.0, 112.0), 3.0));
        // Lyre-shaped legs, a rail between their feet and an arch up to the balance.
        let (shoulder, waist, foot) =
            (DVec2::new(43.0, 158.0), DVec2::new(32.0, 112.0), DVec2::new(50.0, 56.0));
        parts.push(curve(mirrored, shoulder, DVec2::new(30.0, 140.0), waist, 4.2));
        parts.push(curve(mirrored, waist, DVec2::new(34.0, 84.0), foot, 4.6));
        parts.push(curve(mirrored, foot, DVec2::new(30.0, 60.0), DVec2::new(0.0, BALANCE.y), 3.4));
        parts.push(bar(mirrored, DVec2::new(0.0, 46.8), DVec2::new(56.0, 46.8), 5.0, 5.0));
        let mut shape = parts
            .into_iter()
            .fold(f64::INFINITY, |a, b| if a.is_finite() { smooth_union(a, b, 5.0) } else { b });
        for arbor in &arbors {
            shape = smooth_union(shape, disc(p, arbor.at, 7.0), 4.0);
        }
        shape = smooth_union(shape, bar(p, escape, PALLETS, 2.6, 2.6), 5.0);
        shape = smooth_union(shape, disc(p, PALLETS, 5.6), 3.0);
        shape = smooth_union(shape, disc(p, BALANCE, 7.5), 4.0);
        for pillar in &pillars {
            shape = smooth_union(shape, disc(p, *pillar, 6.4), 4.0);
        }
        shape
    };
    let low = DVec2::new(-66.0, 38.0);
    let high = DVec2::new(66.0, 256.0);
    let mut outline = contours(field, low, high, 0.7, 0.02).swap_remove(0);
    for arbor in &arbors {
        outline = outline.with_hole(circle(arbor.at, 3.2, 32));
    }
    for place in [BALANCE, PALLETS] {
        outline = outline.with_hole(circle(place, 3.2, 32));
    }
    extrude(&outline, &beveled(-1.5, 1.5, 0.55))
}

/// A turned pillar from plate to plate, its ends at z = ±15.
fn pillar() -> Solid {
    let mut half = vec![(2.6, 1.0), (2.6, 6.5), (3.2, 7.2), (3.2, 8.0), (2.6, 8.6), (3.0, 9.4)];
    half.extend([(4.4, 10.6), (4.8, 11.8), (4.4, 13.0), (3.6, 13.6), (5.2, 14.0), (5.2, 15.0)]);
    let mut profile: Vec<(f64, f64)> = half.iter().rev().map(|&(r, z)| (r, -z)).collect();
    profile.insert(0, (0.0, -15.0));
    profile.extend([(3.5, -0.4), (3.7, 0.0), (3.5, 0.4)]);
    profile.extend(half);
    profile.push((0.0, 15.0));
    turned(&profile, 40)
}

/// A cheese-head screw with a slot; its head stands on z = 0.
fn screw() -> Solid {
    // The head is split by the slot: two halves of a disc, and the slot's floor below them.
    let mut solid = turned(&[(0.0, -0.5), (3.2, -0.5), (3.2, 1.3), (0.0, 1.3)], 40);
    let mut half: Vec<DVec2> = Vec::new();
    let (radius, slot) = (3.2f64, 0.42f64);
    let start = libm::asin(slot / radius).to_degrees();
    for i in 0..=20 {
        half.push(polar(radius, start + (180.0 - 2.0 * start) * f64::from(i) / 20.0));
    }
    let half = extrude(&Outline::new(half), &rounded(1.3, 2.5, 0.35, 3)[1..]);
    solid.append(&half);
    solid.append(&half.rotated(2, 180.0));
    solid
}

/// A gold ring that holds a jewel in a plate of z = ±1.5.
fn chaton() -> Solid {
    let profile = [
        (2.0, -1.6),
        (3.25, -1.6),
        (3.25, 1.7),
        (2.95, 2.0),
        (2.5, 2.0),
        (2.2, 1.7),
        (2.0, 1.2),
        (2.0, -1.6),
    ];
    turned(&profile, 40)
}

/// The enamel ring, slightly domed, from radius 44 to 64; its texture covers 130 mm.
fn dial() -> Solid {
    let mut profile = vec![(44.0, -1.0), (64.0, -1.0)];
    for i in 0..=12 {
        let t = f64::from(i) / 12.0;
        profile.push((64.0 - 20.0 * t, 0.3 + 1.6 * (4.0 * t * (1.0 - t))));
    }
    profile.push((44.0, -1.0));
    turned(&profile, 120).with_planar_uvs(130.0)
}

/// Polished rings around the dial, outside and inside.
fn bezel() -> Solid {
    let ring = |radius: f64, half_width: f64, height: f64| {
        let mut profile = vec![(radius - half_width, -1.8), (radius + half_width, -1.8)];
        for i in 0..=10 {
            let p = polar(1.0, 18.0 * f64::from(i));
            profile.push((radius + half_width * p.x, height * p.y));
        }
        profile.push((radius - half_width, -1.8));
        turned(&profile, 128)
    };
    let mut solid = ring(64.6, 1.6, 3.4);
    solid.append(&ring(43.6, 1.1, 2.6));
    solid
}

/// A hand after Breguet: a slender bar, an eccentric moon near the tip. It points along +Y.
fn hand(length: f64, moon: f64, foot: f64) -> Solid {
    let center = DVec2::new(0.0, length * 0.74);
    let hole = center + DVec2::new(0.0, moon * 0.28);
    let field = |p: DVec2| {
        use distance::{bar, disc, smooth_intersection, smooth_union};
        let shaft = bar(p, DVec2::new(0.0, -length * 0.16), center, foot * 0.62, foot * 0.36);
        let tip = bar(p, center, DVec2::new(0.0, length), foot * 0.42, 0.3);
        let body = smooth_union(smooth_union(shaft, tip, 0.3), disc(p, center, moon), 0.8);
        let boss = disc(p, DVec2::ZERO, foot * 1.7);
        smooth_intersection(smooth_union(body, boss, 1.2), -disc(p, hole, moon * 0.58), 0.1)
    };
    let low = DVec2::new(-6.0, -length * 0.3);
    let outline = contours(field, low, DVec2::new(6.0, length + 2.0), 0.16, 0.008).swap_remove(0);
    extrude(&outline, &beveled(-0.4, 0.4, 0.22))
}

fn hand_cap() -> Solid {
    let mut profile = vec![(0.0, -12.0), (1.6, -12.0), (1.6, 0.0), (2.6, 0.0), (2.6, 0.5)];
    profile.extend((1..=5).map(|i| {
        let p = polar(1.0, 18.0 * f64::from(i));
        (if i == 5 { 0.0 } else { 2.6 * p.x }, 0.5 + 1.3 * p.y)
    }));
    turned(&profile, 32)
}

/// The balance wheel with three arms and timing screws around its rim.
fn balance() -> Solid {
    let mut outline = Outline::new(circle(DVec2::ZERO, 25.0, 144));
    for window in gears::windows(4.5, 21.8, 3, 2.6, 1.6) {
        outline = outline.with_hole(window);
    }
    let mut solid = extrude(&outline, &beveled(-1.4, 1.4, 0.4));
    let mut head = vec![(0.0, -1.0), (0.7, -1.0), (0.7, 0.6), (1.25, 0.7), (1.25, 1.9), (1.0, 2.2)];
    head.push((0.0, 2.2));
    let head: Vec<DVec2> = head.into_iter().map(DVec2::from).collect();
    for i in 0..18 {
        // A lathe's axis is +Y; rotated to point outwards.
        let degrees = 20.0 * f64::from(i) + 10.0;
        let at = polar(25.0, degrees);
        solid.append(&lathe(&head, 14).rotated(2, degrees - 90.0).translated(at.x, at.y, 0.0));
    }
    solid.append(&turned(&[(0.0, -3.0), (2.6, -3.0), (2.6, 3.2), (2.2, 3.6), (0.0, 3.6)], 32));
    solid
}

/// The bridge over the balance: from a foot at x = −35 to the jewel at the origin, 2.4 mm thick, its underside at z =
/// 0; the foot reaches down to z = −12.
fn balance_cock() -> Solid {
    let root = DVec2::new(-36.0, 0.0);
    let field = |p: DVec2| {
        use distance::{bar, curve, disc, smooth_union};
        let mirrored = DVec2::new(p.x, p.y.abs());
        let arm = curve(mirrored, DVec2::new(-35.0, 8.0), DVec2::new(-20.0, 1.5), DVec2::ZERO, 2.2);
        let foot = bar(mirrored, DVec2::new(-36.0, 0.0), DVec2::new(-36.0, 9.0), 5.0, 5.0);
        smooth_union(smooth_union(arm, foot, 4.0), disc(p, DVec2::ZERO, 6.2), 3.0)
    };
    let (low, high) = (DVec2::new(-46.0, -18.0), DVec2::new(10.0, 18.0));
    let outline = contours(field, low, high, 0.35, 0.012).swap_remove(0);
    let outline = outline.with_hole(circle(DVec2::ZERO, 3.2, 32));
    let mut solid = extrude(&outline, &beveled(0.0, 2.4, 0.45));
    let foot = Outline::new(rounded_rectangle(9.0, 27.0, 4.4, 10));
    solid.append(&extrude(&foot, &beveled(-12.0, -0.01, 0.3)).translated(root.x, root.y, 0.0));
    solid
}

/// The lever: pivot at the origin, the escape wheel above (+Y), the fork below.
fn pallet_fork() -> Solid {
    let field = |p: DVec2| {
        use distance::{bar, curve, disc, smooth_union};
        let mirrored = DVec2::new(p.x.abs(), p.y);
        let arm = curve(mirrored, DVec2::ZERO, DVec2::new(6.0, 0.5), DVec2::new(9.2, 6.6), 1.15);
        let lever = bar(p, DVec2::ZERO, DVec2::new(0.0, -16.0), 1.5, 0.9);
        let prong =
            curve(mirrored, DVec2::new(0.0, -15.0), DVec2::new(2.2, -16.0), DVec2::new(1.7, -19.0), 0.6);
        smooth_union(smooth_union(arm, smooth_union(lever, prong, 0.6), 1.5), disc(p, DVec2::ZERO, 2.4), 1.0)
    };
    let (low, high) = (DVec2::new(-13.0, -22.0), DVec2::new(13.0, 10.0));
    let outline = contours(field, low, high, 0.2, 0.01).swap_remove(0);
    extrude(&outline, &beveled(-0.7, 0.7, 0.18))
}

fn pallet_stone() -> Solid {
    let outline = Outline::new(rounded_rectangle(1.5, 4.6, 0.2, 2));
    extrude(&outline, &beveled(-0.9, 0.9, 0.12))
}

/// Rotates an outline in XY to lie flat, with +Z upwards.
fn lying(solid: Solid) -> Solid {
    solid.rotated(0, -90.0)
}

/// The plinth, from y = 10 to 42, its upper edge an ogee; box-mapped, 200 mm an image.
fn base() -> Solid {
    let outline = Outline::new(rounded_rectangle(164.0, 92.0, 16.0, 12));
    let mut profile = vec![(0.8, 10.0), (0.0, 10.8), (0.0, 24.0), (0.8, 24.8), (2.4, 24.8)];
    let curve = bezier([(2.4, 24.8), (2.4, 31.0), (9.0, 30.0), (9.4, 37.0)], 12);
    profile.extend(curve.map(|p| (p.x, p.y)));
    profile.extend([(10.2, 37.8), (11.0, 37.8), (11.0, 41.2), (11.8, 42.0)]);
    lying(extrude(&outline, &profile)).with_box_uvs(200.0)
}

/// A polished band around the foot of the plinth.
fn moulding() -> Solid {
    let outline = Outline::new(rounded_rectangle(172.0, 100.0, 20.0, 12));
    let mut profile = vec![(1.2, 5.6), (0.2, 6.2)];
    for i in 0..=8 {
        let p = polar(1.0, -70.0 + 20.0 * f64::from(i));
        profile.push((2.0 - 2.0 * p.x, 8.3 + 2.0 * p.y));
    }
    profile.push((5.0, 10.6));
    lying(extrude(&outline, &profile))
}

/// A turned foot from y = 0 to 6.
fn foot() -> Solid {
    let mut profile = vec![DVec2::ZERO, DVec2::new(7.0, 0.0)];
    profile.extend(bezier([(7.0, 0.0), (11.5, 1.0), (11.5, 4.0), (8.0, 4.4)], 10));
    profile.extend([(7.4, 4.8), (7.4, 6.0), (0.0, 6.0)].map(DVec2::from));
    lathe(&profile, 48)
}

/// An urn, standing on y = 0.
fn finial() -> Solid {
    let mut profile = vec![DVec2::ZERO, DVec2::new(5.0, 0.0), DVec2::new(5.0, 1.2)];
    profile.extend(bezier([(5.0, 1.2), (2.0, 2.0), (1.6, 3.4), (2.0, 4.4)], 8));
    profile.extend([(3.0, 4.6), (3.2, 5.2), (2.6, 5.7)].map(DVec2::from));
    profile.extend(bezier([(2.6, 5.7), (7.6, 7.0), (6.6, 13.0), (2.6, 14.2)], 14));
    profile.extend([(3.1, 14.6), (3.1, 15.2), (2.0, 15.6)].map(DVec2::from));
    profile.extend(bezier([(2.0, 15.6), (1.6, 18.0), (0.9, 20.0), (0.0, 22.0)], 8));
    let last = profile.len() - 1;
    profile[last].x = 0.0;
    lathe(&profile, 48)
}
