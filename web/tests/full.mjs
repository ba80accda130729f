// What `npm test` leaves out: the page in Firefox, and, of the page as it is shipped, its weight and the bits of every method.

import './every-bit.test.mjs';
import './firefox.test.mjs';
import './weight.test.mjs';
