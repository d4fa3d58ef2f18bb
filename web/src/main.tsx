import { render } from 'preact';
import './style/tokens.css';
import './style/layout.css';
import './style/controls.css';
import './style/panels.css';
import './style/stage.css';
import './style/own.css';
import './style/game.css';
import { effect } from '@preact/signals';
import { connect, isController, send, state } from './store';
import { App } from './ui/App';
import { beginFeedback } from './ui/feedback';
import { beginGames } from './ui/game';
import { beginGoals } from './ui/goals';
import { beginRestoring } from './ui/restore';
import { neededField, theme } from './ui/settings';
import { beginLinks } from './ui/share';
import { computed } from '@preact/signals';
import { drawPlainly } from './machine';

drawPlainly();

effect(() => {
  document.documentElement.dataset.theme = theme.value;
});

render(<App />, document.getElementById('app')!);
beginFeedback();
beginGoals();
beginGames();
beginRestoring();
beginLinks();
connect();

// The engine computes a field only while a page shows it.
const shownField = computed(() => state.value?.field);
effect(() => {
  const field = neededField.value;
  if (isController.value && shownField.value !== field) send({ type: 'show_field', field });
});
