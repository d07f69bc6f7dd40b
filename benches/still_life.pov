// scenes/still_life.ron in POV-Ray's language, for the time of both: povray +Istill_life.pov +W1920 +H1440 -A +WT1
// (twice the width and height for 4 samples a pixel). Left-handed: z is mirrored.
#version 3.7;
global_settings { assumed_gamma 1 max_trace_level 12 adc_bailout 1/1024 ambient_light 1 }
#default { finish { ambient 0.12 } }
camera { location <0.4, 2.5, -7.2> look_at <0.05, 0.72, 0> right 4/3*x angle 2*degrees(atan(tan(radians(17))*4/3)) }
sky_sphere { pigment { gradient y color_map { [0 rgb <0.315, 0.425, 0.625>] [1 rgb <0.08, 0.2, 0.5>] } } }
light_source { <-5, 7, -6> rgb 700/(4*pi*110) }
light_source { <5, 4.5, -3> rgb 60/(pi*50) area_light 1.5*x, 1.5*y, 3, 3 jitter }
#macro Shiny(Specular, Size, Mirror) finish { specular Specular roughness 1/Size reflection { Mirror } diffuse 1 } #end
plane { y, 0 pigment { checker srgb <0.29, 0.165, 0.11> srgb <0.847, 0.784, 0.659> } Shiny(0.2, 60, 0.12) }
plane { -z, -4 pigment { brick srgb <0.72, 0.69, 0.643> srgb <0.549, 0.29, 0.212> brick_size <0.91, 0.46, 1> mortar 0.03 } }
#declare Marble = texture {
    pigment { marble turbulence 1 octaves 6 scale 0.45
        color_map { [0 srgb <0.957, 0.941, 0.91>] [0.5 srgb <0.863, 0.824, 0.769>] [0.8 srgb <0.54, 0.5, 0.47>] [1 srgb <0.235, 0.22, 0.21>] } }
    Shiny(0.5, 120, 0.06) };
cylinder { <-1.35, 0, 0.6>, <-1.35, 0.5, 0.6>, 0.75 texture { Marble } }
lathe { cubic_spline 17,
    <0, 0>, <0, 0>, <0.3, 0>, <0.34, 0.06>, <0.56, 0.5>, <0.5, 0.85>, <0.22, 1.15>, <0.2, 1.35>, <0.32, 1.52>,
    <0.28, 1.52>, <0.16, 1.35>, <0.18, 1.15>, <0.45, 0.85>, <0.5, 0.5>, <0.28, 0.1>, <0, 0.08>, <0, 0.08>
    pigment { srgb <0.114, 0.353, 0.447> } Shiny(0.8, 200, 0.12) translate <-1.35, 0.5, 0.6> }
torus { 0.5, 0.17 pigment { rgb <0.35, 0.14, 0.07> } Shiny(0.6, 90, <0.5, 0.25, 0.15>) rotate <-72, -18, 0> translate <1.55, 0.62, 0.7> }
sphere { <0.25, 0.62, 1.1>, 0.62 pigment { rgb 0.04 } Shiny(0.9, 300, 0.85) }
sphere { <0.85, 0.42, -0.9>, 0.42 pigment { rgbt <0.92, 0.97, 0.94, 1> }
    finish { specular 0.9 roughness 1/400 diffuse 0 reflection { 1 fresnel on } conserve_energy } interior { ior 1.5 } }
#declare Peel = texture { pigment { bozo scale 0.11 color_map { [0.2 srgb <0.816, 0.337, 0.047>] [0.8 srgb <0.933, 0.58, 0.125>] } } Shiny(0.3, 25, 0) };
sphere { 0, 0.3 texture { Peel } translate <-0.25, 0.3, -0.75> }
sphere { 0, 0.28 texture { Peel } rotate <-40, 0, 70> translate <-0.75, 0.28, -0.35> }
superellipsoid { <0.13, 0.13> scale <0.3, 0.25, 0.3>
    pigment { wood turbulence 0.3 octaves 3 scale 0.083 rotate <90, 8, 0>
        color_map { [0 srgb <0.478, 0.282, 0.141>] [0.7 srgb <0.627, 0.416, 0.212>] [1 srgb <0.353, 0.196, 0.086>] } }
    Shiny(0.25, 40, 0) rotate <0, 28, 0> translate <1.8, 0.25, -0.6> }
