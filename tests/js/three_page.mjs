// SPDX-License-Identifier: MIT
// The page of three_test.mjs: the sample level in three.js, lit by relume/three, and its pictures against those of `relume render`.
import * as THREE from 'three';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {lightsOf, RelumeLoader} from 'relume/three';
import {loadModule, RelumeError} from 'relume';

const kSize = [320, 180], kSmall = [160, 90];

// A spot of one cone: three's edge is a smoothstep, KHR_lights_punctual's a square.
function addSpot(scene) {
  const light = new THREE.SpotLight(0xffffff, 25, 0, 0.7, 0);
  light.name = 'own';
  light.position.set(1.5, 2.2, 1.5);
  light.target.position.set(1.5, 0, 1.9);
  scene.add(light, light.target);
}

async function loadLevel(lights, level) {
  const {scene, cameras} = await new GLTFLoader().loadAsync(`/work/${level}_game.glb`);
  addSpot(scene);
  scene.traverse((object) => {
    if (object.isMesh) object.castShadow = object.receiveShadow = true;
    if (object.isLight) {
      object.visible = lights.includes(object.name) || lights.includes(object.parent?.name);
      object.castShadow = true;
      object.shadow.mapSize.set(2048, 2048);
      object.shadow.bias = -0.0005;
      object.shadow.normalBias = 0.01;
      if (object.isDirectionalLight) Object.assign(object.shadow.camera, {left: -9, right: 9, top: 9, bottom: -9, near: -10, far: 30});
    }
  });
  return {scene, cameras};
}

// The level in a canvas of the page, by one of its cameras. parameters: of the renderer.
async function open(camera, lights, [width, height], antialias, {level = 'level', ...parameters} = {}) {
  const renderer = new THREE.WebGLRenderer({antialias, ...parameters});
  renderer.setSize(width, height);
  renderer.shadowMap.enabled = true;
  document.body.replaceChildren(renderer.domElement);
  const {scene, cameras} = await loadLevel(lights, level), view = cameras.find((each) => each.name === camera || each.parent?.name === camera);
  view.aspect = width / height;
  view.updateProjectionMatrix();
  view.updateWorldMatrix(true, false);
  return {renderer, scene, view};
}

// The same, small, with a small bake.
async function openLit(camera, light, {wasm = false, level = 'small', ...parameters} = {}) {
  const {renderer, scene, view} = await open(camera, [light], kSmall, false, {level, ...parameters});
  const lighting = await new RelumeLoader().loadAsync(`/work/${level}.relume`);
  lighting.options = {forceFallback: wasm};
  lighting.applyTo(scene);
  const target = new THREE.WebGLRenderTarget(...kSmall, {type: THREE.FloatType});
  const read = (from) => {
    const pixels = new Float32Array(4 * from.width * from.height);
    renderer.readRenderTargetPixels(from, 0, 0, from.width, from.height, pixels);
    return pixels.filter((_, i) => i % 4 < 3);
  };
  return {
    renderer, scene, view, lighting, read,
    // The same frames from the same start have the same light.
    frames(count) {
      lighting.relighter?.reset();
      for (let i = 0; i < count; ++i) {
        renderer.render(scene, view);
        lighting.update(renderer, scene);
      }
    },
    draw(direct, indirect) {
      lighting.show.set(direct, indirect);
      renderer.setRenderTarget(target);
      renderer.render(scene, view);
      renderer.setRenderTarget(null);
      return read(target);
    },
    ball(options = {}) {
      const ball = new THREE.Mesh(new THREE.SphereGeometry(0.3, 32, 16), new THREE.MeshLambertMaterial(options));
      ball.position.copy(view.getWorldPosition(new THREE.Vector3()).addScaledVector(view.getWorldDirection(new THREE.Vector3()), 1.5));
      return ball;
    },
    end() {
      const error = renderer.getContext().getError();
      lighting.dispose();
      target.dispose();
      renderer.dispose();
      renderer.forceContextLoss();
      return error;
    },
  };
}

const sumOf = (values) => values.reduce((sum, v) => sum + v, 0);
// How much two pictures differ, of the first one's light.
const differenceOf = (a, b) => a.reduce((sum, v, i) => sum + Math.abs(v - b[i]), 0) / sumOf(a);

// What the page is told on the console in the meantime.
async function warningsOf(run) {
  const told = [], {warn} = console;
  console.warn = (text) => told.push(text);
  try {
    await run();
  } finally {
    console.warn = warn;
  }
  return told;
}

function eachMaterial(scene, use) {
  scene.traverse((mesh) => mesh.isMesh && (mesh.material = use(mesh.material)));
}

// The picture of a canvas or a PNG as linear light.
const kLinear = Float32Array.from({length: 256}, (_, v) => (v <= 10 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
async function linearOf(url) {
  const image = new Image();
  image.src = url;
  await image.decode();
  const canvas = new OffscreenCanvas(...kSize), context = canvas.getContext('2d');
  context.drawImage(image, 0, 0);
  return Float32Array.from(context.getImageData(0, 0, ...kSize).data, (v) => kLinear[v]);
}

// found and expected: RGBA. Energy, and relative RMSE away from edges: where `expected` varies by less than a fifth within two pixels.
function compare(found, expected) {
  const [width, height] = kSize, yOf = (v, i) => 0.25 * v[4 * i] + 0.5 * v[4 * i + 1] + 0.25 * v[4 * i + 2];
  let sumFound = 0, sumExpected = 0, d2 = 0, y2 = 0, smooth = 0;
  for (let y = 2; y < height - 2; ++y) {
    for (let x = 2; x < width - 2; ++x) {
      const i = y * width + x, e = yOf(expected, i), f = yOf(found, i);
      sumFound += f;
      sumExpected += e;
      let low = e, high = e;
      for (let dy = -2; dy <= 2; ++dy) for (let dx = -2; dx <= 2; ++dx) {
        const near = yOf(expected, i + dy * width + dx);
        low = Math.min(low, near);
        high = Math.max(high, near);
      }
      if (high - low > 0.2 * e) continue;
      smooth += 1;
      d2 += (f - e) ** 2;
      y2 += e ** 2;
    }
  }
  return {energy: sumFound / sumExpected, rmse: Math.sqrt(d2 / y2), smooth: smooth / (width * height), mean: sumExpected / (width * height)};
}

window.tests = {
  // Indirect irradiance / pi by a camera under one light, as `relume render --aov indirect` has it.
  async indirect(camera, light, expectedUrl, exposure) {
    const {renderer, scene, view} = await open(camera, [light], kSize, false);
    // White, so that what is drawn is irradiance / pi; textures cut holes alone.
    eachMaterial(scene, ({side, map, alphaTest}) => {
      const white = new THREE.MeshLambertMaterial({color: 0xffffff, side, shadowSide: THREE.DoubleSide, map: alphaTest > 0 ? map : null, alphaTest});
      white.onBeforeCompile = (shader) => {
        shader.fragmentShader = shader.fragmentShader.replace('#include <map_fragment>', '#include <map_fragment>\ndiffuseColor.rgb = vec3(1.0);');
      };
      return white;
    });
    const lighting = await new RelumeLoader().loadAsync('/work/level.relume');
    lighting.applyTo(scene);
    lighting.show.set(0, 1);
    for (let i = 0; i < 10; ++i) {
      renderer.render(scene, view);
      lighting.update(renderer, scene, {emissionScale: [0, 0, 0]});
    }
    const target = new THREE.WebGLRenderTarget(...kSize, {type: THREE.FloatType});
    renderer.setRenderTarget(target);
    renderer.render(scene, view);
    const pixels = new Float32Array(4 * kSize[0] * kSize[1]), found = new Float32Array(pixels.length), scale = 2 ** exposure;
    renderer.readRenderTargetPixels(target, 0, 0, ...kSize, pixels);
    for (let y = 0; y < kSize[1]; ++y) {
      for (let x = 0; x < 4 * kSize[0]; ++x) found[4 * kSize[0] * y + x] = Math.min(scale * pixels[4 * kSize[0] * (kSize[1] - 1 - y) + x], 1);
    }
    renderer.setRenderTarget(null);
    const result = {...compare(found, await linearOf(expectedUrl)), backend: lighting.relighter.backend};
    // The same picture for whoever looks at it.
    lighting.show.set(0, 2 ** exposure);
    renderer.render(scene, view);
    this.clean = async () => {
      const module = await loadModule();
      lighting.dispose();
      target.dispose();
      renderer.dispose();
      return module.liveBytes;
    };
    return result;
  },
  // A ball with a material of three's own in a grid of probes, against the same ball with one of Relume's: the light of both, and what
  // the probes change of the level around, which reads its own light.
  async probes(camera, light, wasm) {
    const {renderer, scene, view} = await open(camera, [light], kSize, false);
    const lighting = await new RelumeLoader().loadAsync('/work/level.relume');
    lighting.options = {forceFallback: wasm};
    lighting.applyTo(scene);
    const ball = new THREE.Mesh(new THREE.SphereGeometry(0.35, 64, 32), new THREE.MeshLambertMaterial({color: 0xffffff}));
    ball.position.copy(view.getWorldPosition(new THREE.Vector3()).addScaledVector(view.getWorldDirection(new THREE.Vector3()), 2));
    scene.add(ball);
    const probes = lighting.probes(), refusals = [];
    for (const options of [{resolution: new THREE.Vector3(4, 0, 4)}, {box: new THREE.Box3()}]) {
      try { lighting.probes(options); } catch (error) { refusals.push(error.message); }
    }
    scene.add(probes);
    for (let i = 0; i < (wasm ? 2 : 8); ++i) {
      renderer.render(scene, view);
      lighting.update(renderer, scene);
    }
    scene.traverse((object) => object.isLight && !object.isLightProbeGrid && (object.visible = false));
    const target = new THREE.WebGLRenderTarget(...kSize, {type: THREE.FloatType});
    const draw = () => {
      const pixels = new Float32Array(4 * kSize[0] * kSize[1]);
      renderer.setRenderTarget(target);
      renderer.render(scene, view);
      renderer.readRenderTargetPixels(target, 0, 0, ...kSize, pixels);
      renderer.setRenderTarget(null);
      return pixels;
    };
    const byProbes = draw();
    const size = probes.resolution.toArray();
    probes.visible = false;
    const unlit = draw();
    lighting.applyTo(ball);
    const byGrid = draw();
    probes.visible = true;
    const both = draw();
    probes.visible = false;
    ball.visible = false;
    const level = draw();
    ball.visible = true;
    let lit = 0, dark = 0, sum = 0, expected = 0, d2 = 0, y2 = 0, pixels = 0, twice = 0, elsewhere = 0;
    for (let i = 0; i < byGrid.length; i += 4) {
      twice = Math.max(twice, Math.abs(both[i + 1] - byGrid[i + 1]));
      if (unlit[i + 1] === level[i + 1] && byGrid[i + 1] === level[i + 1]) {
        elsewhere = Math.max(elsewhere, Math.abs(byProbes[i + 1] - level[i + 1]));
        continue;
      }
      pixels += 1;
      lit = Math.max(lit, byProbes[i + 1]);
      dark = Math.max(dark, unlit[i + 1]);
      sum += byProbes[i + 1];
      expected += byGrid[i + 1];
      d2 += (byProbes[i + 1] - byGrid[i + 1]) ** 2;
      y2 += byGrid[i + 1] ** 2;
    }
    probes.visible = true;
    const error = renderer.getContext().getError();
    renderer.render(scene, view);
    this.clean = async () => {
      lighting.dispose();
      target.dispose();
      renderer.dispose();
      return {bytes: (await loadModule()).liveBytes, inScene: probes.parent !== null};
    };
    return {pixels, lit, dark, energy: sum / expected, rmse: Math.sqrt(d2 / y2), twice, elsewhere, size, refusals, error, backend: lighting.relighter.backend};
  },
  // A level's bake replaced by a new one, which is applied before the old one is disposed of: the indirect light stays, and at the end the
  // host has its materials back, but for one that it changed itself. Before that a context that is lost before the first update().
  async reload(camera, light) {
    const {renderer, scene, view} = await open(camera, [light], kSize, false), own = new Map();
    scene.traverse((mesh) => mesh.isMesh && own.set(mesh, mesh.material));
    const target = new THREE.WebGLRenderTarget(...kSize, {type: THREE.FloatType}), pixels = new Float32Array(4 * kSize[0] * kSize[1]);
    const load = async () => {
      const lighting = await new RelumeLoader().loadAsync('/work/level.relume');
      lighting.applyTo(scene);
      lighting.show.set(0, 1);
      return lighting;
    };
    const lightOf = (lighting) => {
      for (let i = 0; i < 6; ++i) {
        renderer.render(scene, view);
        lighting.update(renderer, scene, {emissionScale: [0, 0, 0]});
      }
      renderer.setRenderTarget(target);
      renderer.render(scene, view);
      renderer.readRenderTargetPixels(target, 0, 0, ...kSize, pixels);
      renderer.setRenderTarget(null);
      return pixels.reduce((sum, v, i) => (i % 4 < 3 ? sum + v : sum), 0);
    };
    const event = (type) => new Promise((done) => renderer.domElement.addEventListener(type, done, {once: true}));
    const old = await load(), lost = event('webglcontextlost');
    renderer.forceContextLoss();
    renderer.render(scene, view);
    old.update(renderer, scene);
    await lost;
    const waits = old.relighter === null, restored = event('webglcontextrestored');
    setTimeout(() => renderer.forceContextRestore(), 10);
    await restored;
    const before = lightOf(old), next = await load();
    old.dispose();
    const after = lightOf(next), [changed] = own.keys(), mine = new THREE.MeshBasicMaterial();
    changed.material = mine;
    next.dispose();
    const back = [...own].every(([mesh, material]) => mesh.material === (mesh === changed ? mine : material));
    this.clean = async () => {
      target.dispose();
      renderer.dispose();
      return (await loadModule()).liveBytes;
    };
    return {before, change: after / before - 1, waits, back, meshes: own.size, error: renderer.getContext().getError()};
  },
  // Which coordinates are the light map's: a level with a TEXCOORD_1 of its own and extras on its nodes has the light of the one without, also where the
  // sets are numbered above those that three has names for, and where the mesh alone names them; a ball with a uv1 has that of one without.
  async coordinates(camera, light) {
    const plain = await openLit(camera, light);
    plain.frames(4);
    const expected = plain.draw(0, 1);
    plain.end();
    const lit = await openLit(camera, light, {level: 'small_uv'}), {scene, lighting} = lit, balls = [lit.ball(), lit.ball()];
    const named = [];
    scene.traverse((mesh) => mesh.geometry?.userData.relume && named.push(mesh));
    lit.frames(4);
    const differences = [differenceOf(expected, lit.draw(0, 1))];
    for (const change of [
      ({geometry}) => {
        geometry.setAttribute('texcoord_4', geometry.attributes.uv2);
        geometry.deleteAttribute('uv2');
        geometry.userData.relume.lightmapTexcoord = 4;
      },
      ({geometry, userData}) => {
        userData.relume = geometry.userData.relume;
        delete geometry.userData.relume;
      },
    ]) {
      lighting.remove(scene);
      named.forEach(change);
      lighting.applyTo(scene);
      differences.push(differenceOf(expected, lit.draw(0, 1)));
    }
    balls[1].geometry.setAttribute('uv1', balls[1].geometry.attributes.uv.clone());
    const [ball, other] = balls.map((each) => {
      lighting.applyTo(each);
      scene.add(each);
      const picture = lit.draw(0, 1);
      scene.remove(each);
      return picture;
    });
    return {named: named.length, differences, ball: differenceOf(ball, other), shown: differenceOf(ball, lit.draw(0, 1)), error: lit.end()};
  },
  // With either way of depth: direct light before update() and after it.
  async reversed(camera, light, reversedDepthBuffer) {
    const lit = await openLit(camera, light, {reversedDepthBuffer}), {depth} = lit.renderer.state.buffers;
    const before = lit.draw(1, 0), was = depth.getReversed();
    lit.frames(2);
    return {light: sumOf(before), change: differenceOf(before, lit.draw(1, 0)), reversed: [was, depth.getReversed()], error: lit.end()};
  },
  // What the page has set for its pictures leaves the light of the surfels and the probes as it is, and is the page's again after update(), and so are
  // the renderer's counts.
  async aside(camera, light) {
    const lit = await openLit(camera, light), {renderer, scene, view, lighting} = lit, {xr, info} = renderer;
    const probes = lighting.probes({resolution: new THREE.Vector3(6, 2, 6)}), masks = [];
    scene.add(probes);
    scene.traverse(({layers}) => masks.push(layers.mask));
    lit.frames(1);
    const lightOf = (around = (update) => update()) => {
      lighting.relighter.reset();
      for (let i = 0; i < 2; ++i) {
        renderer.render(scene, view);
        for (const target of [lighting.surfels.target, probes.irradiance]) {
          renderer.setRenderTarget(target);
          renderer.clear();
        }
        renderer.setRenderTarget(null);
        around(() => lighting.update(renderer, scene));
      }
      return [lighting.surfels.target, probes.irradiance].map((target) => sumOf(lit.read(target)));
    };
    const changeOf = (light) => Math.max(...light.map((v, i) => Math.abs(v / expected[i] - 1)));
    const expected = lightOf(), change = {}, kept = {}, masksAfter = [];
    scene.traverse(({layers}) => masksAfter.push(layers.mask));

    const planes = renderer.clippingPlanes = [new THREE.Plane(new THREE.Vector3(0, -1, 0), 1.2)];
    change.clipped = changeOf(lightOf());
    kept.planes = renderer.clippingPlanes === planes && planes.length === 1;
    renderer.clippingPlanes = [];

    const ball = new THREE.Mesh(new THREE.SphereGeometry(0.1), new THREE.MeshBasicMaterial({color: 0xff0000}));
    ball.position.z = -1;  // before the surfels' camera
    ball.layers.enableAll();
    scene.add(ball);
    change.layers = changeOf(lightOf());
    kept.layers = ball.layers.mask === -1 && masksAfter.every((mask, i) => mask === masks[i]);
    scene.remove(ball);

    // A headset of two cameras, while update() runs.
    const eyes = new THREE.ArrayCamera([0, 80].map((x) => Object.assign(view.clone(), {viewport: new THREE.Vector4(x, 0, 80, 90)})));
    Object.assign(xr, {cameraAutoUpdate: false, getCamera: () => eyes, hasDepthSensing: () => false, getDepthSensingMesh: () => null});
    xr.enabled = true;
    change.headset = changeOf(lightOf((update) => {
      xr.isPresenting = true;
      update();
      xr.isPresenting = false;
    }));
    kept.headset = xr.enabled;
    xr.enabled = false;

    renderer.render(scene, view);
    const counts = ({calls, triangles, points, lines}) => [calls, triangles, points, lines].join(), drawn = counts(info.render);
    lighting.update(renderer, scene);
    kept.counts = counts(info.render) === drawn && info.autoReset;
    return {expected, change, kept, error: lit.end()};
  },
  // Lights that three takes and the library refuses, by WebAssembly. The render target stays the page's.
  async fallback(camera, light) {
    const lit = await openLit(camera, light, {wasm: true}), {renderer, scene, lighting, view} = lit, change = {};
    const lightOf = (...lights) => {
      scene.add(...lights);
      lit.frames(2);
      for (const each of lights) each.visible = false;
      return lit.draw(0, 1);
    };
    const near = (light) => (light.position.copy(lit.ball().position), light), plain = lightOf(new THREE.Group());
    const aimless = [new THREE.SpotLight(), new THREE.DirectionalLight()];
    for (const each of aimless) each.position.set(0, 0, 0);  // where their targets are
    change.aimless = differenceOf(plain, lightOf(...aimless));
    change.negative = differenceOf(plain, lightOf(near(new THREE.PointLight(0xffffff, -3))));
    change.endless = differenceOf(lightOf(near(new THREE.PointLight(0xffffff, 3, 0))), lightOf(near(new THREE.PointLight(0xffffff, 3, Infinity))));
    const target = new THREE.WebGLRenderTarget(8, 8);
    renderer.setRenderTarget(target);
    renderer.render(scene, view);
    lighting.update(renderer, scene);
    const held = renderer.getRenderTarget() === target;
    target.dispose();
    return {change, held, lights: lightsOf(scene).length, error: lit.end()};
  },
  // One lighting for two renderers; what a loader was told; a level that is moved; things that come and go.
  async host(camera, light) {
    const lit = await openLit(camera, light), {renderer, scene, view, lighting} = lit, found = {};
    lit.frames(1);
    const other = new THREE.WebGLRenderer();
    try { lighting.update(other, scene); } catch (error) { found.refused = error instanceof RelumeError ? error.message : `${error}`; }
    found.otherError = other.getContext().getError();
    other.dispose();
    other.forceContextLoss();

    const {fetch} = window, loader = new RelumeLoader().setRequestHeader({Authorization: 'Bearer key'}).setWithCredentials(true);
    window.fetch = (url, options) => (found.asked = [options.headers.Authorization, options.credentials], fetch(url, options));
    try { (await loader.loadAsync('/work/small.relume')).dispose(); } finally { window.fetch = fetch; }

    const meshes = lighting.meshes.size, materials = lighting.patched.size, ball = lit.ball(), own = ball.material;
    scene.add(ball);
    lighting.applyTo(ball);
    const worn = ball.material !== own;
    lighting.remove(ball);
    own.dispose();
    found.removed = [worn, ball.material === own, lighting.meshes.size - meshes, lighting.patched.size - materials];

    const move = (object) => warningsOf(() => {
      object.position.x += 20;
      for (let i = 0; i < 2; ++i) {
        renderer.render(scene, view);
        lighting.update(renderer, scene);
      }
    });
    lighting.applyTo(ball);
    found.warnings = [await move(ball), await move(scene)];
    return {...found, error: lit.end()};
  },
  // The level with its own materials, all light, and a ball that moves through it.
  async full(camera, lights) {
    const {renderer, scene, view} = await open(camera, lights, [800, 450], true);
    renderer.toneMapping = THREE.ACESFilmicToneMapping;
    const ball = new THREE.Mesh(new THREE.SphereGeometry(0.3, 48, 24), new THREE.MeshStandardMaterial({color: 0xffffff, roughness: 1}));
    ball.position.copy(view.getWorldPosition(new THREE.Vector3()).addScaledVector(view.getWorldDirection(new THREE.Vector3()), 2.5));
    ball.castShadow = ball.receiveShadow = true;
    scene.add(ball);
    eachMaterial(scene, (material) => Object.assign(material, {shadowSide: THREE.DoubleSide}));
    const lighting = await new RelumeLoader().loadAsync('/work/level.relume');
    lighting.applyTo(scene);
    for (let i = 0; i < 8; ++i) {
      renderer.render(scene, view);
      lighting.update(renderer, scene);
    }
    renderer.render(scene, view);
    return {calls: renderer.info.render.calls, errors: renderer.getContext().getError()};
  },
};
document.documentElement.dataset.ready = 'yes';
