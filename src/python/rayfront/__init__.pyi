from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

_Path = str | PathLike[str]
Layer = Literal["depth", "normal", "albedo", "position", "entity", "material", "coverage", "samples", "variance"]
Tonemap = Literal["clamp", "scale-by-maximum", "reinhard", "aces", "agx", "pbr-neutral"]
Coherence = Literal["unknown", "coherent", "scattered"]
Quality = Literal["fast", "default", "high"]

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
    """What has been rendered."""

    def numpy(self) -> NDArray[np.float32]:
        """Linear radiance with the primaries of Rec. 709: (height, width, 3), top row first."""
    @property
    def denoised(self) -> NDArray[np.float32] | None:
        """The same without noise, if that was asked for."""
    @property
    def layers(self) -> dict[str, NDArray[Any]]:
        """What else was asked for, by name: (height, width), or (height, width, 3)."""
    @property
    def names(self) -> dict[str, dict[int, str]]:
        """What the numbers in the layers `entity` and `material` stand for: `names["entity"][3]`."""
    @property
    def pose(self) -> NDArray[np.float32]:
        """From the camera's space, in which it looks along -Z and up is +Y, to the world's: (4, 4)."""
    @property
    def intrinsics(self) -> NDArray[np.float32] | None:
        """Focal lengths and the principal point in pixels: (3, 3). None of an orthographic camera."""
    @property
    def film_hash(self) -> str:
        """Of the exact sums of all samples: equal films have equal ones, whatever machine made them."""
    @property
    def size(self) -> list[int]:
        """Width and height in pixels."""
    @property
    def samples(self) -> float:
        """Samples a pixel, on average."""
    @property
    def exposure(self) -> float:
        """Stops by which pictures are exposed: `render(exposure=…)` gives another rendering the same."""
    @property
    def noise(self) -> float | None:
        """The noise that is left, as a part of the image's brightness; None after one sample."""
    @property
    def warnings(self) -> list[str]:
        """What is probably not as it was meant."""
    @property
    def notes(self) -> list[str]:
        """What every scene of its kind is told, such as that a camera was added."""
    def srgb(self, denoised: bool = ...) -> NDArray[np.uint8]:
        """As screens show it, exposed and tone mapped as the scene says: (height, width, 3)."""
    def save(self, path: _Path, bits: Literal[8, 16] = ..., denoised: bool = ...) -> None:
        """Writes a `.png` (exposed and tone mapped as the scene says), an `.exr` with all layers, or an `.hdr`.

        bits: a channel, of PNG files. denoised: without noise, if that was asked for.
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
    """From now on, scenes of this process may refer to files outside their folders: for scenes that you trust."""

def load(
    path: _Path,
    *,
    time: float | None = ...,
    variant: str | None = ...,
    scene: str | int | None = ...,
    env: str | None = ...,
    set: str | Iterable[str] = ...,
    hide: str | Iterable[str] = ...,
    only: str | Iterable[str] = ...,
    look_at: Sequence[Sequence[float]] | None = ...,
    orbit: Sequence[float] | None = ...,
    zoom: float | None = ...,
    ground: bool = ...,
    light_units: Literal["auto", "candela", "watt"] = ...,
    solid_glass: bool = ...,
    double_sided: bool = ...,
    size: Sequence[int] | None = ...,
) -> World: ...

class Hits(NamedTuple):
    t: NDArray[np.float32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    instance: NDArray[np.int32]
    shape: NDArray[np.int32]
    primitive: NDArray[np.int32]

class SceneBuilder:
    def __init__(self, quality: Quality = ...) -> None: ...
    def add_mesh(self, vertices: ArrayLike | Any, faces: ArrayLike | None = ...) -> int: ...
    def add_spheres(self, spheres: ArrayLike) -> int: ...
    def place(self, shape: int, to_world: ArrayLike | None = ...) -> int: ...
    def build(self) -> Scene: ...

class Scene:
    def __init__(self, vertices: ArrayLike | Any, faces: ArrayLike | None = ..., *, quality: Quality = ...) -> None: ...
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

Aces: Variant
Agx: Variant
Albedo: Variant
All: Variant
Alpha: Variant
Area: Variant
Auto: Variant
Bilinear: Variant
BlackmanHarris: Variant
Blend: Variant
Blinn: Variant
BlinnPhong: Variant
Blue: Variant
Box: Variant
Center: Variant
Clamp: Variant
Constant: Variant
Coverage: Variant
Default: Variant
Depth: Variant
Directional: Variant
Disc: Variant
Entity: Variant
Environment: Variant
Fast: Variant
Fixed: Variant
Gaussian: Variant
Gradient: Variant
Green: Variant
High: Variant
Image: Variant
Independent: Variant
InverseSquare: Variant
Jittered: Variant
Keys: Variant
Linear: Variant
LookAt: Variant
Mask: Variant
Material: Variant
Matrix: Variant
Mirror: Variant
Nearest: Variant
Normal: Variant
Off: Variant
On: Variant
Opaque: Variant
Orthographic: Variant
Path: Variant
PbrNeutral: Variant
Phong: Variant
Photometric: Variant
Pinhole: Variant
Plane: Variant
Point: Variant
Position: Variant
Principled: Variant
Rectangle: Variant
Red: Variant
Regular: Variant
Reinhard: Variant
Repeat: Variant
Samples: Variant
ScaleByMaximum: Variant
Sky: Variant
Smooth: Variant
Sobol: Variant
Sphere: Variant
Spot: Variant
Srgb: Variant
Step: Variant
Tent: Variant
Texture: Variant
ThinLens: Variant
Triangle: Variant
Trilinear: Variant
Unbiased: Variant
Uniform: Variant
Variance: Variant
Whitted: Variant
