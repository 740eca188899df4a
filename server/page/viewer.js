// The viewer as the daemon serves it: defined as soon as it is loaded.
import { defineViewer } from '../../api/client/viewer.js';

export * from '../../api/client/tweend.js';
export * from '../../api/client/viewer.js';

defineViewer();
