// SPDX-License-Identifier: MIT
// A level whose light follows a sun and a lamp: three.js draws it, relume/three relights it after each frame.
import * as THREE from 'three';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {RelumeLoader} from 'relume/three';

const element = (id) => document.getElementById(id), number = (id) => Number(element(id).value);
const view = element('view'), status = element('status');
const renderer = new THREE.WebGLRenderer({canvas: view.querySelector('canvas'), antialias: true});
renderer.shadowMap.enabled = true;
renderer.toneMapping = THREE.ACESFilmicToneMapping;
renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
const camera = new THREE.PerspectiveCamera(60, 1, 0.02, 1000), controls = new OrbitControls(camera, renderer.domElement);

const scene = new THREE.Scene(), sun = new THREE.DirectionalLight(0xfff2e0), lamp = new THREE.PointLight(0xffe2b8);
const bulb = new THREE.Mesh(new THREE.SphereGeometry(0.06, 24, 12), new THREE.MeshBasicMaterial({color: 0xffe2b8, toneMapped: false}));
for (const light of [sun, lamp]) {
  light.castShadow = true;
  light.shadow.mapSize.set(2048, 2048);
  light.shadow.bias = -0.0005;
  light.shadow.normalBias = 0.01;
}
lamp.shadow.mapSize.set(512, 512);
lamp.shadow.camera.near = 0.07;  // outside the bulb
lamp.add(bulb);
scene.add(sun, sun.target, lamp);

let level = null;  // {root, lighting, sphere, name}
let opens = 0;     // how often open() was called: the last call wins

async function open(name) {
  const turn = ++opens;
  if (level) close(level);
  level = null;
  status.textContent = `${name} …`;
  const lightingOf = new RelumeLoader().loadAsync(`levels/${name}.relume.gz`, ({loaded, total}) => {
    if (turn === opens) status.textContent = `${name}: ${(loaded / 1048576).toFixed(1)}${total ? ` of ${(total / 1048576).toFixed(1)}` : ''} MiB`;
  });
  const loads = await Promise.allSettled([new GLTFLoader().loadAsync(`levels/${name}.glb`), lightingOf]);
  const [gltf, lighting] = loads.map(({value}) => value), failed = loads.find(({status}) => status === 'rejected');
  const root = gltf?.scene, own = [];
  if (failed || turn !== opens) {
    close({root, lighting});
    if (turn !== opens) return;  // another level is shown, or loads: what failed here is no news any more
    throw failed.reason;
  }
  root.traverse((object) => {
    if (object.isLight) own.push(object);
    if (!object.isMesh) return;
    object.castShadow = object.receiveShadow = true;
    object.material.shadowSide = THREE.DoubleSide;
  });
  for (const light of own) light.visible = false;  // ours are in their place
  scene.add(root);
  lighting.applyTo(root);
  const sphere = new THREE.Box3().setFromObject(root).getBoundingSphere(new THREE.Sphere()), from = gltf.cameras[0];
  if (from) {
    from.updateWorldMatrix(true, false);
    from.matrixWorld.decompose(camera.position, camera.quaternion, new THREE.Vector3());
    camera.fov = from.isPerspectiveCamera ? from.fov : 60;
  } else {
    camera.position.copy(sphere.center);
  }
  controls.target.copy(camera.position).addScaledVector(camera.getWorldDirection(new THREE.Vector3()), 2.5);
  lamp.position.copy(controls.target).add(new THREE.Vector3(0, 0.3, 0));
  Object.assign(sun.shadow.camera, {left: -sphere.radius, right: sphere.radius, top: sphere.radius, bottom: -sphere.radius, near: 0, far: 2 * sphere.radius});
  sun.shadow.camera.updateProjectionMatrix();
  sun.target.position.copy(sphere.center);
  level = {root, lighting, sphere, name};
  status.textContent = '';
  resize();
}

// Frees a level, or the part of one that has loaded.
function close({root, lighting}) {
  lighting?.dispose();
  if (!root) return;
  scene.remove(root);
  root.traverse((mesh) => {
    if (!mesh.isMesh) return;
    mesh.geometry.dispose();
    Object.values(mesh.material).forEach((value) => value?.isTexture && value.dispose());
    mesh.material.dispose();
  });
}

function resize() {
  renderer.setSize(view.clientWidth, view.clientHeight, false);
  camera.aspect = view.clientWidth / Math.max(view.clientHeight, 1);
  camera.updateProjectionMatrix();
}

// Drag the lamp in the plane that faces the camera.
const ray = new THREE.Raycaster(), plane = new THREE.Plane(), grip = new THREE.Vector3();
let drags = false;
function pointAt(event) {
  const box = renderer.domElement.getBoundingClientRect();
  ray.setFromCamera(new THREE.Vector2((event.clientX - box.x) / box.width * 2 - 1, 1 - (event.clientY - box.y) / box.height * 2), camera);
}
renderer.domElement.addEventListener('pointerdown', (event) => {
  pointAt(event);
  // A finger is wider than the bulb.
  if (ray.ray.distanceToPoint(lamp.position) > 0.03 * camera.position.distanceTo(lamp.position) + 0.06) return;
  drags = true;
  controls.enabled = false;
  plane.setFromNormalAndCoplanarPoint(camera.getWorldDirection(new THREE.Vector3()), lamp.position);
  renderer.domElement.setPointerCapture(event.pointerId);
}, {capture: true});
renderer.domElement.addEventListener('pointermove', (event) => {
  if (!drags) return;
  pointAt(event);
  if (ray.ray.intersectPlane(plane, grip)) lamp.position.copy(grip);
});
for (const type of ['pointerup', 'pointercancel']) {
  renderer.domElement.addEventListener(type, () => {
    drags = false;
    controls.enabled = true;
  });
}

const kSky = new THREE.Color(0.35, 0.5, 0.8), kShow = {direct: [1, 0], indirect: [0, 1], both: [1, 1]};
let last = performance.now(), frameMs = 0, relightMs = 0;
renderer.setAnimationLoop((now) => {
  if (!level) return;
  const azimuth = THREE.MathUtils.degToRad(number('azimuth')), height = THREE.MathUtils.degToRad(number('height')), share = number('sun') / 14;
  const toward = new THREE.Vector3(Math.sin(azimuth) * Math.cos(height), Math.sin(height), -Math.cos(azimuth) * Math.cos(height));
  sun.position.copy(level.sphere.center).addScaledVector(toward, level.sphere.radius);
  sun.intensity = number('sun');
  lamp.intensity = number('lamp') * Math.max(1, (level.sphere.radius / 6) ** 2);  // it fills large levels as well
  bulb.visible = lamp.intensity > 0;
  scene.background = kSky.clone().multiplyScalar(share);
  controls.update();
  level.lighting.show.set(...kShow[new FormData(document.forms[0]).get('show')]);
  renderer.render(scene, camera);
  const begin = performance.now();
  level.lighting.update(renderer, scene, {skyRadiance: scene.background.toArray()});
  // Of the page's thread; the GPU works on.
  relightMs += 0.1 * (performance.now() - begin - relightMs);
  frameMs += 0.1 * (now - last - frameMs);
  last = now;
  const {relighter, bake} = level.lighting;
  element('times').textContent = `frame ${frameMs.toFixed(1)} ms, of which relighting keeps the page ${relightMs.toFixed(1)} ms` +
      ` (${relighter.backend === 'webgl2' ? 'WebGL 2' : `WebAssembly: ${relighter.reason}`}); ${bake.info.surfels} surfels, ${bake.info.caches} caches`;
});

const fail = (error) => {
  status.textContent = error.message;
  console.error(error);
};
addEventListener('resize', resize);
element('level').addEventListener('change', (event) => open(event.target.value).catch(fail));
try {
  const names = await (await fetch('levels/levels.json')).json();
  element('level').replaceChildren(...names.map((name) => new Option(name)));
  await open(names[0]);
  document.documentElement.dataset.ready = 'yes';
} catch (error) {
  fail(error);
}
