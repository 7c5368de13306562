// SPDX-License-Identifier: Apache-2.0
// Build of the viewer's page into the Python package; the same sources and lock file give the same bytes.
import { defineConfig } from 'vite'

export default defineConfig({
  base: './',
  build: {
    outDir: '../python/deltalux/viewer',
    emptyOutDir: true,
    target: 'es2022',
    license: { fileName: 'LICENSES.md' }, // of what is bundled
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1000,
    rollupOptions: {
      output: {
        // Names without hashes: a rebuild changes files, it does not rename them.
        entryFileNames: 'assets/viewer.js',
        assetFileNames: 'assets/[name][extname]',
      },
    },
  },
})
