// The API reference at /docs: Swagger UI over the daemon's openapi.json. Requests that are tried go to the daemon itself.
import SwaggerUI from 'swagger-ui-dist/swagger-ui-es-bundle.js';

const dark = matchMedia('(prefers-color-scheme: dark)');
const applyScheme = () => document.documentElement.classList.toggle('dark-mode', dark.matches);
applyScheme();
dark.addEventListener('change', applyScheme);

const ui = SwaggerUI({
  url: new URL('openapi.json', document.baseURI).href, // the daemon may be served below a prefix
  dom_id: '#reference',
  deepLinking: true,
  docExpansion: 'list',
  defaultModelsExpandDepth: 0,
  validatorUrl: null, // asks another host otherwise
});

// Swagger UI follows the address only while it loads. Its own changes of the address cause no such event.
addEventListener('hashchange', () => {
  ui.layoutActions.parseDeepLinkHash(location.hash);
  document.getElementById(`operations${location.hash.slice(1).replaceAll('/', '-')}`)?.scrollIntoView();
});
