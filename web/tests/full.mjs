// Tests that `npm test` omits: the page in Firefox, and the size of the shipped page and its bits with every method.

import './every-bit.test.mjs';
import './firefox.test.mjs';
import './weight.test.mjs';
