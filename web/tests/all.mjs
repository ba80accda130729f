// Tests in Chromium, in one process, so that they share the browser and the server.

import './assist.test.mjs';
import './bits.test.mjs';
import './embed.test.mjs';
import './film.test.mjs';
import './page.test.mjs';
import './serving.test.mjs';
import './session.test.mjs';
import './sound.test.mjs';
import './touch.test.mjs';
