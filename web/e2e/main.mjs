// All tests in one process, so that they share viewer and browser. Each file also runs alone.

import './touch.test.mjs';
