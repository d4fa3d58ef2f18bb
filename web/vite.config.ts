import { defineConfig } from 'vite';

// The page is put into the binary: see crates/palpa-viewer. For work on the page itself, `npm run dev` beside `palpa view
// --no-open --port 7750` serves it with the engine behind it.
export default defineConfig({
  build: { target: 'es2022', chunkSizeWarningLimit: 1200 },
  server: {
    proxy: {
      '/ws': { target: 'ws://127.0.0.1:7750', ws: true },
      '/api': 'http://127.0.0.1:7750',
    },
  },
});
