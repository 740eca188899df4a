// A page that shows a model which it uploads.
import { defineViewer } from 'tweend/viewer';

import { box } from './model';

defineViewer();
const viewer = document.querySelector('tweend-viewer');
if (viewer) {
  viewer.setAttribute('base', 'http://127.0.0.1:8080');
  // @ts-expect-error: a client is no text
  const faulty = () => (viewer.client = 'http://127.0.0.1:8080');
  viewer.addEventListener('load', () => console.log(viewer.gltf?.scene.name, faulty.length));
  viewer.setAttribute('model', await box(viewer.client));
}
