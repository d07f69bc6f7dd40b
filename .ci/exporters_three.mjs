// Writes small scenes with the default options of three.js' GLTFExporter. usage: exporters_three.mjs FOLDER
import { mkdirSync, writeFileSync } from "node:fs";
import * as THREE from "three";
import { GLTFExporter } from "three/examples/jsm/exporters/GLTFExporter.js";

// The exporter expects a browser's reader of blobs.
globalThis.FileReader = class {
  read(blob, result) { blob.arrayBuffer().then((bytes) => { this.result = result(bytes); this.onloadend(); }); }
  readAsArrayBuffer(blob) { this.read(blob, (bytes) => bytes); }
  readAsDataURL(blob) { this.read(blob, (b) => `data:${blob.type};base64,${Buffer.from(b).toString("base64")}`); }
};

const paint = (color, more) => new THREE.MeshStandardMaterial({ color, roughness: 0.6, ...more });
const mesh = (geometry, material = paint(0xc08040)) => new THREE.Mesh(geometry, material);
const knot = () => new THREE.TorusKnotGeometry(1, 0.3, 64, 12);
const tube = () => new THREE.CylinderGeometry(1, 1, 2, 16, 1, true);
const placed = (thing, ...position) => (thing.position.set(...position), thing);

const scenes = {
  plain: () => [mesh(knot())],
  groups: () => [mesh(new THREE.BoxGeometry(2, 2, 2), [1, 2, 3, 4, 5, 6].map((i) => paint(i * 0x2a1105)))],
  double_sided: () => [mesh(tube(), paint(0x80ff80, { side: THREE.DoubleSide }))],
  one_sided: () => [mesh(tube())],
  unlit_and_flat: () => [mesh(knot(), new THREE.MeshBasicMaterial({ color: 0x4080c0 })),
    placed(mesh(new THREE.IcosahedronGeometry(1.5, 1), paint(0xc0c0c0, { flatShading: true })), 4, 0, 0)],
  lines_and_points: () => [mesh(new THREE.BoxGeometry()), new THREE.LineSegments(new THREE.BoxGeometry(2, 2, 2)),
    new THREE.Points(new THREE.SphereGeometry(1, 8, 6))],
  physical: () => [mesh(new THREE.SphereGeometry(), new THREE.MeshPhysicalMaterial({ color: 0xffc0c0, transmission: 1,
    thickness: 1, clearcoat: 1, sheen: 0.5, iridescence: 0.5, ior: 1.4, attenuationDistance: 2 }))],
  vertex_colours: () => {
    const ball = new THREE.SphereGeometry(1, 24, 16);
    const colours = Array.from(ball.attributes.position.array, (x) => 0.5 + x / 2);
    ball.setAttribute("color", new THREE.Float32BufferAttribute(colours, 3));
    return [mesh(ball, paint(0xffffff, { vertexColors: true }))];
  },
  instanced: () => {
    const many = new THREE.InstancedMesh(new THREE.BoxGeometry(), paint(0x80c0a0), 5);
    for (let i = 0; i < 5; i++) many.setMatrixAt(i, new THREE.Matrix4().makeRotationY(i).setPosition(2 * i, i % 2, 0));
    return [many];
  },
  mirrored: () => {
    const parent = new THREE.Group().add(mesh(knot()).rotateX(0.5));
    parent.scale.set(-1, 1, 2);
    return [parent];
  },
  lamps: () => {
    const spot = placed(new THREE.SpotLight(0xffffff, 200, 0, 0.4, 0), -1, 3, 0);
    const sun = placed(new THREE.DirectionalLight(0xff8000, 20), 0, 0, 0).rotateX(-1.2);
    for (const lamp of [spot, sun]) lamp.add(placed(lamp.target, 0, 0, -1));
    const matte = new THREE.MeshPhysicalMaterial({ color: 0xc0c0c0, specularIntensity: 0 });
    return [mesh(new THREE.BoxGeometry(6, 0.1, 6), matte), spot.rotateX(-1.5), sun,
      placed(new THREE.PointLight(0x40ff40, 100), 1.5, 1, 1)];
  },
};

for (const [name, make] of Object.entries(scenes)) {
  const scene = new THREE.Scene().add(...make());
  scene.updateMatrixWorld(true);
  const base = `${process.argv[2]}/three_${name}`;
  mkdirSync(base);
  writeFileSync(`${base}/three.glb`, Buffer.from(await new GLTFExporter().parseAsync(scene, { binary: true })));
  writeFileSync(`${base}/three.gltf`, JSON.stringify(await new GLTFExporter().parseAsync(scene)));
}
