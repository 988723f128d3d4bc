// The parts of three.js that the report's 3D view uses. The bundle omits all other parts.
export {
  AmbientLight, Box3, BoxGeometry, BufferGeometry, Color, ConeGeometry, CylinderGeometry, DirectionalLight,
  Float32BufferAttribute, GridHelper, Group, HemisphereLight, LineBasicMaterial, LineDashedMaterial,
  LineSegments, Matrix4, Mesh, MeshLambertMaterial, OctahedronGeometry, PerspectiveCamera, Quaternion,
  REVISION, Scene, SphereGeometry, Spherical, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
