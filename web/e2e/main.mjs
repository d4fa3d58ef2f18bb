// All tests in one process, so that they share viewer and browser. Each file also runs alone.

import './touch.test.mjs';
import './bars.test.mjs';
import './cutaway.test.mjs';
import './game.test.mjs';
import './map.test.mjs';
import './lens.test.mjs';
import './goals.test.mjs';
import './recording.test.mjs';
import './scene.test.mjs';
import './power.test.mjs';
import './own.test.mjs';
import './access.test.mjs';
import './curves.test.mjs';
import './first.test.mjs';
import './connection.test.mjs';
import './words.test.mjs';
