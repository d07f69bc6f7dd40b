from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

_Path = str | PathLike[str]
_Number = float | Variant
_Color = ArrayLike | str | Variant
Layer = Literal["depth", "normal", "albedo", "position", "entity", "material", "coverage", "samples", "variance", "nodes", "tests", "path-length", "time"]
Tonemap = Literal["clamp", "scale-by-maximum", "reinhard", "aces", "agx", "pbr-neutral"]
Coherence = Literal["unknown", "coherent", "scattered"]

class SceneWarning(UserWarning): ...

class Finding(NamedTuple):
    about: str | None
    what: str
    remedy: str | None

class Variant:
    def __init__(self, name: str, values: Iterable[Any] = ..., fields: Mapping[str, Any] | None = ...) -> None: ...
    def __call__(self, *values: Any, **fields: Any) -> Variant: ...

class Mesh(Variant):
    arrays: tuple[NDArray[Any] | None, ...] | None
    def __init__(
        self,
        vertices: ArrayLike | _Path | Any,
        faces: ArrayLike | None = ...,
        normals: ArrayLike | None = ...,
        uvs: ArrayLike | None = ...,
        colors: ArrayLike | None = ...,
    ) -> None: ...

class Rendering:
    """A rendered image."""

    def numpy(self) -> NDArray[np.float32]:
        """Linear radiance with the primaries of Rec. 709: (height, width, 3), top row first."""
    @property
    def denoised(self) -> NDArray[np.float32] | None:
        """The denoised radiance, if it was requested."""
    @property
    def layers(self) -> dict[str, NDArray[Any]]:
        """The requested layers by name: (height, width), or (height, width, 3)."""
    @property
    def names(self) -> dict[str, dict[int, str]]:
        """The names for the numbers in the layers `entity` and `material`: `names["entity"][3]`."""
    @property
    def pose(self) -> NDArray[np.float32]:
        """The matrix from camera space, which looks along -Z with +Y up, to world space: (4, 4)."""
    @property
    def intrinsics(self) -> NDArray[np.float32] | None:
        """Focal lengths and the principal point in pixels: (3, 3). None for an orthographic camera."""
    @property
    def film_hash(self) -> str:
        """The hash of the exact sums of all samples; it is equal on all machines."""
    @property
    def size(self) -> list[int]:
        """Width and height in pixels."""
    @property
    def samples(self) -> float:
        """The average number of samples per pixel."""
    @property
    def exposure(self) -> float:
        """The exposure in stops; `render(exposure=…)` gives another rendering the same exposure."""
    @property
    def noise(self) -> float | None:
        """The estimated noise, as a fraction of the image's brightness; None after one sample."""
    @property
    def warnings(self) -> list[str]:
        """Probable mistakes."""
    @property
    def notes(self) -> list[str]:
        """Notes, such as that a camera was added."""
    def srgb(self, denoised: bool = ...) -> NDArray[np.uint8]:
        """The image for screens, with the scene's exposure and tone curve: (height, width, 3)."""
    def save(self, path: _Path, bits: Literal[8, 16] = ..., denoised: bool = ...) -> None:
        """Writes a `.png`, `.jpg` or `.webp` (with the scene's exposure and tone curve), an `.exr` with all layers, or an `.hdr`.

        bits: bits per channel of PNG files. denoised: writes the denoised image, if it was requested.
        """
    def __array__(self, dtype: Any = ..., copy: bool | None = ...) -> NDArray[Any]: ...
    def _repr_png_(self) -> bytes: ...

class World:
    text: str | None
    def __init__(
        self,
        entities: Iterable[Mapping[str, Any]] = ...,
        *,
        materials: Mapping[str, Any] | None = ...,
        settings: Mapping[str, Any] | None = ...,
        folder: _Path = ...,
    ) -> None: ...
    @property
    def cameras(self) -> list[str]: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def size(self) -> tuple[int, int]: ...
    def parts(self, query: str | None = ...) -> list[tuple[str, dict[str, str]]]: ...
    def render(
        self,
        size: Sequence[int] | None = ...,
        spp: int | None = ...,
        *,
        seed: int | None = ...,
        camera: str | None = ...,
        layers: Layer | Iterable[Layer] = ...,
        schedule: Literal["wavefront", "recursive"] = ...,
        threads: int = ...,
        denoise: bool = ...,
        crop: Sequence[int] | None = ...,
        noise: float | None = ...,
        depth: int | None = ...,
        exposure: float | Literal["auto"] | None = ...,
        tonemap: Tonemap | Variant | None = ...,
        transport: Literal["path", "whitted", "auto"] | Variant | None = ...,
        progress: Callable[[float], object] | None = ...,
    ) -> Rendering: ...
    def check(self, size: Sequence[int] | None = ..., camera: str | None = ...) -> list[Finding]: ...

def allow_outside() -> None:
    """Lets scenes of this process refer to files outside their folders: for scenes that you trust."""

def load(
    path: _Path,
    *,
    time: float | None = ...,
    variant: str | None = ...,
    scene: str | int | None = ...,
    animation: str | int | None = ...,
    env: str | None = ...,
    set: str | Iterable[str] = ...,
    hide: str | Iterable[str] = ...,
    only: str | Iterable[str] = ...,
    look_at: Sequence[Sequence[float]] | None = ...,
    orbit: Sequence[float] | None = ...,
    zoom: float | None = ...,
    ground: bool | Literal["grey", "shadow"] = ...,
    light_units: Literal["auto", "candela", "watt"] = ...,
    solid_glass: bool = ...,
    double_sided: bool = ...,
    size: Sequence[int] | None = ...,
    up: Literal["y", "z"] = ...,
    env_turn: float | None = ...,
    env_strength: float | None = ...,
    background: str | float | Sequence[float] | None = ...,
    var: Mapping[str, str | float | Sequence[float]] | None = ...,
) -> World: ...

class Hits(NamedTuple):
    t: NDArray[np.float32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    instance: NDArray[np.int32]
    shape: NDArray[np.int32]
    primitive: NDArray[np.int32]

class SceneBuilder:
    def __init__(self) -> None: ...
    def add_mesh(self, vertices: ArrayLike | Any, faces: ArrayLike | None = ...) -> int: ...
    def add_spheres(self, spheres: ArrayLike) -> int: ...
    def place(self, shape: int, to_world: ArrayLike | None = ...) -> int: ...
    def build(self) -> Scene: ...

class Scene:
    def __init__(self, vertices: ArrayLike | Any, faces: ArrayLike | None = ...) -> None: ...
    def closest(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = ...,
        t_max: ArrayLike = ...,
        *,
        coherence: Coherence = ...,
        threads: int = ...,
    ) -> Hits: ...
    def any(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = ...,
        t_max: ArrayLike = ...,
        *,
        coherence: Coherence = ...,
        threads: int = ...,
    ) -> NDArray[np.bool_]: ...
    @property
    def bounds(self) -> NDArray[np.float32] | None: ...
    @property
    def memory_bytes(self) -> int: ...

# The forms of scene files, generated from their tables.
Aces: Variant

class _Add(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        a: _Color,
        b: _Color,
    ) -> Variant: ...

Add: _Add
Agx: Variant
Albedo: Variant
All: Variant
Alpha: Variant

class _Area(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        power_w: _Color = ...,
        radiance: _Color = ...,
        size_m: ArrayLike,
        outline: Variant = ...,
        samples: int = ...,
        pattern: Variant = ...,
        visible: bool = ...,
    ) -> Variant: ...

Area: _Area
Auto: Variant
Bezier: Variant
Bilinear: Variant

class _BlackmanHarris(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        radius: _Number = ...,
    ) -> Variant: ...

BlackmanHarris: _BlackmanHarris
Blend: Variant
Blinn: Variant

class _BlinnPhong(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        diffuse: _Color = ...,
        kd: _Color = ...,
        specular: _Color = ...,
        ks: _Color = ...,
        shininess: _Number = ...,
        highlight: Variant = ...,
        kr: _Color = ...,
        kt: _Color = ...,
        ior: _Number = ...,
        priority: int = ...,
        emission: _Color = ...,
        alpha: _Number = ...,
        alpha_mode: Variant = ...,
        caustics: bool = ...,
    ) -> Variant: ...

BlinnPhong: _BlinnPhong
Blue: Variant

class _Box(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        size_m: ArrayLike = ...,
        bevel_m: _Number = ...,
        segments: int = ...,
    ) -> Variant: ...

Box: _Box

class _Bricks(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        length: _Number = ...,
        mortar: _Number = ...,
        space: Variant = ...,
        scale: float | ArrayLike = ...,
        rotate_degrees: float | ArrayLike = ...,
        offset: float | ArrayLike = ...,
        a: _Color = ...,
        b: _Color = ...,
        stops: Sequence[tuple[float, _Color]] = ...,
        wrap: Variant = ...,
    ) -> Variant: ...

Bricks: _Bricks
Candela: Variant

class _Capsule(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        radius_m: _Number = ...,
        height_m: _Number = ...,
        segments: int = ...,
    ) -> Variant: ...

Capsule: _Capsule
CatmullClark: Variant
CatmullRom: Variant
Cells: Variant
Center: Variant

class _Checker(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        space: Variant = ...,
        scale: float | ArrayLike = ...,
        rotate_degrees: float | ArrayLike = ...,
        offset: float | ArrayLike = ...,
        a: _Color = ...,
        b: _Color = ...,
        stops: Sequence[tuple[float, _Color]] = ...,
        wrap: Variant = ...,
    ) -> Variant: ...

Checker: _Checker
Clamp: Variant

class _Cone(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        radius_m: _Number = ...,
        top_radius_m: _Number = ...,
        height_m: _Number = ...,
        segments: int = ...,
    ) -> Variant: ...

Cone: _Cone
Constant: Variant
Coverage: Variant

class _Curve(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        of: _Color,
        stops: Sequence[tuple[float, _Color]],
    ) -> Variant: ...

Curve: _Curve

class _Cylinder(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        radius_m: _Number = ...,
        height_m: _Number = ...,
        segments: int = ...,
    ) -> Variant: ...

Cylinder: _Cylinder
Depth: Variant

class _Directional(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        irradiance: _Color,
        angle_degrees: _Number = ...,
    ) -> Variant: ...

Directional: _Directional

class _Disc(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        radius_m: _Number = ...,
        inner_radius_m: _Number = ...,
        segments: int = ...,
    ) -> Variant: ...

Disc: _Disc

class _Displace(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        texture: Variant,
        height_m: _Number,
        midlevel: _Number = ...,
    ) -> Variant: ...

Displace: _Displace
Distance: Variant
Edges: Variant
Entity: Variant

class _Environment(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        radiance: _Color = ...,
        image: _Path = ...,
    ) -> Variant: ...

Environment: _Environment
Equidistant: Variant
Equisolid: Variant

class _Fisheye(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        fov_degrees: _Number = ...,
        mapping: Variant = ...,
        circular: bool = ...,
    ) -> Variant: ...

Fisheye: _Fisheye
Fixed: Variant
Flat: Variant
Fractal: Variant

class _Gaussian(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        radius: _Number = ...,
    ) -> Variant: ...

Gaussian: _Gaussian
Gradient: Variant
Green: Variant

class _Grid(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        size_m: ArrayLike = ...,
        columns: int = ...,
        rows: int = ...,
    ) -> Variant: ...

Grid: _Grid

class _HeightField(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        image: _Path,
        size_m: ArrayLike = ...,
        height_m: _Number = ...,
        smooth: bool = ...,
    ) -> Variant: ...

HeightField: _HeightField
Image: Variant
Independent: Variant

class _Intrinsics(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        fx: _Number,
        fy: _Number,
        cx: _Number,
        cy: _Number,
        size: ArrayLike,
    ) -> Variant: ...

Intrinsics: _Intrinsics
InverseSquare: Variant
Jittered: Variant
Kelvin: Variant
Keys: Variant

class _Lathe(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        profile: ArrayLike,
        curve: Variant = ...,
        open: bool = ...,
        segments: int = ...,
    ) -> Variant: ...

Lathe: _Lathe
Left: Variant
Linear: Variant
LookAt: Variant
Loop: Variant
Lumens: Variant
Lux: Variant

class _Marble(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        turbulence: _Number = ...,
        octaves: int = ...,
        space: Variant = ...,
        scale: float | ArrayLike = ...,
        rotate_degrees: float | ArrayLike = ...,
        offset: float | ArrayLike = ...,
        a: _Color = ...,
        b: _Color = ...,
        stops: Sequence[tuple[float, _Color]] = ...,
        wrap: Variant = ...,
    ) -> Variant: ...

Marble: _Marble

class _Mask(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        cutoff: _Number = ...,
    ) -> Variant: ...

Mask: _Mask
Material: Variant
Matrix: Variant

class _Max(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        a: _Color,
        b: _Color,
    ) -> Variant: ...

Max: _Max

class _Metaballs(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        points: ArrayLike,
        radius_m: ArrayLike = ...,
        reach: _Number = ...,
        segments: int = ...,
    ) -> Variant: ...

Metaballs: _Metaballs
Metal: Variant

class _Min(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        a: _Color,
        b: _Color,
    ) -> Variant: ...

Min: _Min
Mirror: Variant

class _Mix(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        a: _Color,
        b: _Color,
        by: _Number,
    ) -> Variant: ...

Mix: _Mix

class _Multiply(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        a: _Color,
        b: _Color,
    ) -> Variant: ...

Multiply: _Multiply
Nearest: Variant
Nits: Variant
Nodes: Variant

class _Noise(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        kind: Variant = ...,
        octaves: int = ...,
        roughness: _Number = ...,
        lacunarity: _Number = ...,
        space: Variant = ...,
        scale: float | ArrayLike = ...,
        rotate_degrees: float | ArrayLike = ...,
        offset: float | ArrayLike = ...,
        a: _Color = ...,
        b: _Color = ...,
        stops: Sequence[tuple[float, _Color]] = ...,
        wrap: Variant = ...,
    ) -> Variant: ...

Noise: _Noise
Normal: Variant

class _Normals(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        smooth_degrees: _Number = ...,
    ) -> Variant: ...

Normals: _Normals
Object: Variant
Off: Variant
On: Variant
Opaque: Variant
Open: Variant
OpenCv: Variant

class _Orthographic(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        height_m: _Number = ...,
    ) -> Variant: ...

Orthographic: _Orthographic
OverUnder: Variant

class _Panorama(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        horizontal_degrees: _Number = ...,
        vertical_degrees: _Number = ...,
    ) -> Variant: ...

Panorama: _Panorama
Path: Variant
PathLength: Variant
PbrNeutral: Variant
Phong: Variant

class _Photographic(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        focal_length_mm: _Number = ...,
        sensor_width_mm: _Number = ...,
        f_stop: _Number = ...,
        focus_distance_m: _Number = ...,
        shift: ArrayLike = ...,
        tilt_degrees: ArrayLike = ...,
        aperture: _Path = ...,
        pattern: Variant = ...,
    ) -> Variant: ...

Photographic: _Photographic

class _Photometric(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        power_w: _Color,
        profile: _Path,
    ) -> Variant: ...

Photometric: _Photometric

class _Pinhole(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        vertical_fov_degrees: _Number = ...,
    ) -> Variant: ...

Pinhole: _Pinhole

class _Plane(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        corners: ArrayLike,
    ) -> Variant: ...

Plane: _Plane

class _Point(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        power_w: _Color,
        falloff: Variant = ...,
        radius_m: _Number = ...,
    ) -> Variant: ...

Point: _Point
Position: Variant

class _Principled(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        base_color: _Color = ...,
        alpha: _Number = ...,
        alpha_mode: Variant = ...,
        metallic: _Number = ...,
        edge_tint: _Color = ...,
        roughness: _Number = ...,
        normal: Variant | Mapping[str, Any] = ...,
        bump: Mapping[str, Any] = ...,
        emission: _Color = ...,
        double_sided: bool = ...,
        unlit: bool = ...,
        shadow_catcher: bool = ...,
        ior: _Number = ...,
        specular: _Number = ...,
        specular_color: _Color = ...,
        transmission: _Number = ...,
        volume: Mapping[str, Any] = ...,
        dispersion: _Number = ...,
        diffuse_transmission: _Number = ...,
        diffuse_transmission_color: _Color = ...,
        clearcoat: _Number = ...,
        clearcoat_roughness: _Number = ...,
        clearcoat_normal: Variant | Mapping[str, Any] = ...,
        sheen_color: _Color = ...,
        sheen_roughness: _Number = ...,
        anisotropy: Mapping[str, Any] = ...,
        iridescence: Mapping[str, Any] = ...,
        caustics: bool = ...,
    ) -> Variant: ...

Principled: _Principled

class _Prism(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        outline: ArrayLike,
        holes: ArrayLike = ...,
        height_m: _Number = ...,
        curve: Variant = ...,
        segments: int = ...,
    ) -> Variant: ...

Prism: _Prism
Rectangle: Variant
Red: Variant
Regular: Variant
Reinhard: Variant
Repeat: Variant
Ridged: Variant
Right: Variant
Round: Variant
Samples: Variant
ScaleByMaximum: Variant
SideBySide: Variant

class _Sky(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        elevation_degrees: _Number = ...,
        azimuth_degrees: _Number = ...,
        haze: _Number = ...,
        radiance: _Color = ...,
        sun: _Number = ...,
        sun_degrees: _Number = ...,
    ) -> Variant: ...

Sky: _Sky
Smooth: Variant
Smoothstep: Variant
Sobol: Variant

class _Sphere(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        radius_m: _Number = ...,
    ) -> Variant: ...

Sphere: _Sphere

class _Spot(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        power_w: _Color,
        inner_degrees: _Number = ...,
        outer_degrees: _Number = ...,
        edge: Variant = ...,
        falloff: Variant = ...,
        radius_m: _Number = ...,
    ) -> Variant: ...

Spot: _Spot
Squared: Variant
Srgb: Variant
Step: Variant
Stereographic: Variant

class _Strands(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        file: _Path,
        radius_m: _Number = ...,
        curve: Variant = ...,
        ends: Variant = ...,
        segments: int = ...,
    ) -> Variant: ...

Strands: _Strands

class _Subdivide(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        levels: int = ...,
        scheme: Variant = ...,
        smooth: bool = ...,
        crease_degrees: _Number = ...,
    ) -> Variant: ...

Subdivide: _Subdivide

class _Subtract(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        a: _Color,
        b: _Color,
    ) -> Variant: ...

Subtract: _Subtract

class _Tent(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        radius: _Number = ...,
    ) -> Variant: ...

Tent: _Tent
Tests: Variant

class _Text(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        text: str,
        font: _Path,
        size_m: _Number = ...,
        depth_m: _Number = ...,
        bevel_m: _Number = ...,
        align: Variant = ...,
        segments: int = ...,
    ) -> Variant: ...

Text: _Text
Texture: Variant

class _ThinLens(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        vertical_fov_degrees: _Number = ...,
        lens_radius_m: _Number,
        focus_distance_m: _Number = ...,
        aperture: _Path = ...,
        pattern: Variant = ...,
    ) -> Variant: ...

ThinLens: _ThinLens
Time: Variant

class _Torus(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        radius_m: _Number = ...,
        tube_radius_m: _Number = ...,
        segments: int = ...,
    ) -> Variant: ...

Torus: _Torus

class _Triangle(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        vertices: ArrayLike,
        normals: ArrayLike = ...,
        uvs: ArrayLike = ...,
    ) -> Variant: ...

Triangle: _Triangle
Trilinear: Variant

class _Tube(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        points: ArrayLike,
        radius_m: ArrayLike = ...,
        curve: Variant = ...,
        ends: Variant = ...,
        segments: int = ...,
    ) -> Variant: ...

Tube: _Tube
Turbulence: Variant
Unbiased: Variant
Uniform: Variant
Uv: Variant
Uv1: Variant
Variance: Variant

class _Vertex(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        channel: Variant = ...,
    ) -> Variant: ...

Vertex: _Vertex

class _Voronoi(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        kind: Variant = ...,
        randomness: _Number = ...,
        space: Variant = ...,
        scale: float | ArrayLike = ...,
        rotate_degrees: float | ArrayLike = ...,
        offset: float | ArrayLike = ...,
        a: _Color = ...,
        b: _Color = ...,
        stops: Sequence[tuple[float, _Color]] = ...,
        wrap: Variant = ...,
    ) -> Variant: ...

Voronoi: _Voronoi
Whitted: Variant

class _Wood(Variant):
    def __call__(  # type: ignore[override]
        self,
        *,
        turbulence: _Number = ...,
        octaves: int = ...,
        space: Variant = ...,
        scale: float | ArrayLike = ...,
        rotate_degrees: float | ArrayLike = ...,
        offset: float | ArrayLike = ...,
        a: _Color = ...,
        b: _Color = ...,
        stops: Sequence[tuple[float, _Color]] = ...,
        wrap: Variant = ...,
    ) -> Variant: ...

Wood: _Wood
