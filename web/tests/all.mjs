// What only a browser can answer, in one process, so that the tests share the browser and the server. They need Chromium alone.

import './assist.test.mjs';
import './bits.test.mjs';
import './embed.test.mjs';
import './film.test.mjs';
import './page.test.mjs';
import './serving.test.mjs';
import './session.test.mjs';
import './sound.test.mjs';
import './touch.test.mjs';
