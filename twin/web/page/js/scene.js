/** The robot's own URDF in three dimensions, moved by its joint states and pose. */

import { html, useEffect, useRef } from "ui";
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import URDFLoader from "urdf";

const FAR_M = 200;
const WALL_CELLS = 600; // on a side of the map, at most

export function Scene({ station, label }) {
  const canvas = useRef();
  useEffect(() => {
    const style = getComputedStyle(document.documentElement), colour = (name) => style.getPropertyValue(`--${name}`).trim();
    const renderer = new THREE.WebGLRenderer({ canvas: canvas.current, antialias: true });
    const scene = new THREE.Scene();
    scene.background = new THREE.Color(colour("map-unknown"));
    const camera = new THREE.PerspectiveCamera(50, 1, 0.05, FAR_M);
    camera.up.set(0, 0, 1);
    const controls = new OrbitControls(camera, canvas.current);
    scene.add(new THREE.HemisphereLight(0xffffff, 0x556677, 2.2));
    const sun = new THREE.DirectionalLight(0xffffff, 2);
    sun.position.set(3, -4, 8);
    scene.add(sun);
    const floor = new THREE.GridHelper(40, 40, colour("line"), colour("line"));
    floor.rotation.x = Math.PI / 2;
    scene.add(floor);
    const points = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ color: colour("scan"), size: 0.05 }));
    points.frustumCulled = false;
    scene.add(points);
    let walls, wallsOf;
    const bodies = new Map(); // robot -> {urdf, body}
    let frame, begun = false, last = new THREE.Vector3();
    const loop = () => {
      frame = requestAnimationFrame(loop);
      const { clientWidth: w, clientHeight: h } = canvas.current;
      renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
      renderer.setSize(w, h, false);
      camera.aspect = w / h;
      camera.updateProjectionMatrix();
      for (const robot of station.robots.values()) {
        if (!robot.urdf) continue;
        if (bodies.get(robot)?.urdf !== robot.urdf) {
          if (bodies.has(robot)) scene.remove(bodies.get(robot).body);
          const files = new THREE.LoadingManager();
          files.setURLModifier((url) => (url.startsWith("meshes/") ? station.address(url, {}) : url));
          const loader = new URDFLoader(files);
          loader.packages = (name) => `meshes/${name}`;
          const body = loader.parse(robot.urdf);
          scene.add(body);
          bodies.set(robot, { urdf: robot.urdf, body });
        }
        const { body } = bodies.get(robot), { p, q } = robot.pose.pose;
        body.position.set(...p);
        body.quaternion.set(...q);
        robot.joints?.name.forEach((name, i) => body.setJointValue(name, robot.joints.position[i]));
      }
      const robot = station.robot;
      if (robot?.scan) points.geometry.setAttribute("position", new THREE.Float32BufferAttribute(robot.scan.placed.flat(), 3));
      const map = robot?.grids.map;
      if (map && wallsOf !== `${robot.space} ${map.version}`) {
        const asked = (wallsOf = `${robot.space} ${map.version}`);
        map.cells(WALL_CELLS).then((cells) => {
          if (asked !== wallsOf) return;
          if (walls) scene.remove(walls);
          scene.add((walls = wallsFrom(cells, colour("map-wall"))));
        }, () => (wallsOf = ""));
      }
      if (robot) {
        const at = new THREE.Vector3(...robot.pose.pose.p);
        if (!begun && robot.urdf) {
          camera.position.copy(at).add(new THREE.Vector3(-2.6, -2.2, 2));
          controls.target.copy(at).setZ(0.4);
          begun = true;
        } else if (begun) {
          const moved = at.clone().sub(last);
          camera.position.add(moved);
          controls.target.add(moved);
        }
        last = at;
      }
      controls.update();
      renderer.render(scene, camera);
    };
    loop();
    return () => { cancelAnimationFrame(frame); controls.dispose(); renderer.dispose(); };
  }, []);
  return html`<canvas ref=${canvas} class="scene" tabindex="0" role="img" aria-label=${label}></canvas>`;
}

/** Boxes of a cell's size where a map is occupied. */
function wallsFrom({ info, data }, colour) {
  const cells = data.flatMap((value, i) => (value > 50 ? [i] : []));
  const size = info.resolution;
  const mesh = new THREE.InstancedMesh(new THREE.BoxGeometry(size, size, 0.4), new THREE.MeshLambertMaterial({ color: colour }), cells.length);
  cells.forEach((cell, i) => mesh.setMatrixAt(i, new THREE.Matrix4().makeTranslation(
    info.origin.position.x + ((cell % info.width) + 0.5) * size, info.origin.position.y + (Math.floor(cell / info.width) + 0.5) * size, 0.2)));
  return mesh;
}
