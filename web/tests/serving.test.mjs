// Delivery of the page: over a network, compressed, stored for offline use, and replaced by a newer build.

import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import http from 'node:http';
import net from 'node:net';
import { after, test } from 'node:test';
import { brotliCompressSync, gzipSync } from 'node:zlib';

import jsQR from 'jsqr';

import { ELSEWHERE, open, PAGE, quit, serveFolder, serveWithFiles } from './harness.mjs';
import { drawNothing } from './inside.mjs';

after(quit);

/** A file as the server sends it, not decompressed. `path` replaces that of the address, and is not normalised. */
function get(address, headers = {}, path = undefined) {
    return new Promise((done, failed) => {
        http.get(address, { headers, ...(path && { path }) }, (response) => {
            const parts = [];
            response.on('data', (part) => parts.push(part));
            response.on('end', () => done({ status: response.statusCode, headers: response.headers, bytes: Buffer.concat(parts) }));
        }).on('error', failed);
    });
}

/** Decodes a QR code printed in a terminal: each character is two modules, one above the other. */
function decodeQr(lines) {
    const [pixels, light] = [4, { '█': [1, 1], '▀': [1, 0], '▄': [0, 1], ' ': [0, 0] }];
    const rows = lines.flatMap((line) => [0, 1].map((half) => [...line].map((sign) => light[sign][half])));
    const [width, height] = [rows[0].length * pixels, rows.length * pixels];
    const picture = new Uint8ClampedArray(4 * width * height).fill(255);
    for (let at = 0; at < width * height; at += 1) {
        const value = 255 * rows[Math.floor(at / width / pixels)][Math.floor((at % width) / pixels)];
        picture.fill(value, 4 * at, 4 * at + 3);
    }
    return jsQR(picture, width, height)?.data;
}

/** A folder with files of this page, compressed as by a build. */
function packedFolder() {
    const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'jointplay-page-'));
    for (const name of ['index.html', 'main.js']) {
        const bytes = fs.readFileSync(path.join(PAGE, name));
        for (const [ending, pack] of [['', (bytes) => bytes], ['.gz', gzipSync], ['.br', brotliCompressSync]]) {
            fs.writeFileSync(path.join(folder, `${name}${ending}`), pack(bytes));
        }
    }
    return folder;
}

test('the server compresses as the browser accepts, sends nothing twice, and answers bad requests', async () => {
    const folder = packedFolder();
    const server = await serveFolder(folder);
    try {
        const address = `${server.address}main.js?build`;
        const tags = new Set();
        for (const [accepted, coding, ending] of [['identity', undefined, ''], ['gzip, deflate', 'gzip', '.gz'], ['gzip, deflate, br', 'br', '.br']]) {
            const { status, headers, bytes } = await get(address, { 'Accept-Encoding': accepted });
            assert.equal(status, 200);
            assert.equal(headers['content-encoding'], coding);
            assert.equal(headers['vary'], 'Accept-Encoding');
            assert.match(headers['content-type'], /^text\/javascript/);
            assert.deepEqual(bytes, fs.readFileSync(path.join(folder, `main.js${ending}`)));
            tags.add(headers.etag);
            const again = await get(address, { 'Accept-Encoding': accepted, 'If-None-Match': `"other", ${headers.etag}` });
            assert.deepEqual([again.status, again.bytes.length, again.headers.etag], [304, 0, headers.etag]);
        }
        assert.equal(tags.size, 3, 'one tag for different bytes');

        const ask = (method, file) => new Promise((done, failed) => {
            const request = http.request(`${server.address}${file}`, { method }, (response) => {
                let length = 0;
                response.on('data', (part) => (length += part.length));
                response.on('end', () => done([response.statusCode, length > 0]));
            });
            request.on('error', failed);
            request.end(method === 'POST' ? 'abc' : undefined);
        });
        assert.deepEqual(await ask('POST', ''), [405, true]);
        assert.deepEqual(await ask('GET', 'none'), [404, true]);
        assert.equal((await get(server.address, {}, '/../main.js')).status, 404);
        fs.writeFileSync(`${folder}.toml`, 'beside it');
        assert.deepEqual(await ask('GET', `%2e%2e/${path.basename(folder)}.toml`), [404, true]);
        assert.deepEqual(await ask('HEAD', 'main.js'), [200, false]);
        assert.equal((await get(server.address)).status, 200);
    } finally {
        await server.end();
        for (const made of [folder, `${folder}.toml`]) fs.rmSync(made, { recursive: true, force: true });
    }
});

test('every connection is answered and kept alive', async () => {
    // A browser opens six at once, and reuses them.
    const count = 12;
    for (let round = 0; round < 10; round += 1) {
        const server = await serveFolder(PAGE);
        const agent = new http.Agent({ keepAlive: true, maxSockets: count });
        try {
            const ask = () => new Promise((done, failed) => {
                const request = http.get(`${server.address}main.js`, { agent }, (response) => {
                    response.resume();
                    response.on('end', () => done(request.reusedSocket));
                });
                request.setTimeout(20_000, () => request.destroy(new Error('a connection gets no answer')));
                request.on('error', failed);
            });
            const all = () => Promise.all(Array.from({ length: count }, ask));
            assert.ok((await all()).every((reused) => !reused));
            assert.ok((await all()).every((reused) => reused), 'a connection is not kept');
        } finally {
            agent.destroy();
            await server.end();
        }
    }
});

/** Opens `count` connections that send `text` and read nothing; returns a function that ends them. */
async function connect(address, count, text) {
    const { hostname: host, port } = new URL(address);
    const sockets = await Promise.all(Array.from({ length: count }, () => new Promise((done, failed) => {
        const socket = net.connect({ host, port }, () => socket.write(text, () => done(socket)));
        // Reading starts with a listener for data.
        socket.once('error', failed);
    })));
    return () => sockets.forEach((socket) => socket.on('error', () => {}).destroy());
}

/** A folder with a file of `size` bytes, which takes no room on the disk. */
function sparseFolder(size) {
    const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'jointplay-page-'));
    fs.writeFileSync(path.join(folder, 'large.wasm'), '');
    fs.truncateSync(path.join(folder, 'large.wasm'), size);
    return folder;
}

test('a class of 183 browsers is answered, and 300 readers that stall cost the server less than 50 MB', async () => {
    const folder = sparseFolder(32e6);
    const server = await serveFolder(folder);
    try {
        const endIdle = await connect(server.address, 1100, '');
        assert.equal((await get(`${server.address}none`)).status, 404);
        endIdle();
        const endStalled = await connect(server.address, 300, 'GET /large.wasm HTTP/1.1\r\nHost: here\r\n\r\n');
        const whole = await get(`${server.address}large.wasm`);
        assert.deepEqual([whole.status, whole.bytes.length], [200, 32e6]);
        if (process.platform === 'linux') {
            const [, peak] = /VmHWM:\s*(\d+) kB/.exec(fs.readFileSync(`/proc/${server.pid}/status`, 'utf8'));
            assert.ok(peak < 50e3, `${peak} kB`);
        }
        endStalled();
    } finally {
        await server.end();
        fs.rmSync(folder, { recursive: true });
    }
});

test('where the system allows few open files, connections beyond them are told so and the server survives', async () => {
    const folder = sparseFolder(1);
    const server = await serveWithFiles(64, folder);
    try {
        const end = await connect(server.address, 100, '');
        const refused = await get(`${server.address}large.wasm`);
        assert.equal(refused.status, 503);
        assert.match(String(refused.bytes), /^\d+ connections are open, the most that this server answers/);
        assert.ok(refused.headers['retry-after']);
        end();
        let { status } = refused;
        while (status === 503) ({ status } = await get(`${server.address}large.wasm`));
        assert.equal(status, 200);
    } finally {
        await server.end();
        fs.rmSync(folder, { recursive: true });
    }
});

test('a server for other devices prints its address as text and as a QR code, and is reachable there', async () => {
    const shared = await serveFolder(PAGE, 0, '0.0.0.0');
    const local = await serveFolder(PAGE);
    try {
        const [address, ...lines] = shared.output.trimEnd().split('\n');
        const { hostname, port } = new URL(address);
        const own = Object.values(os.networkInterfaces()).flat().map((network) => network.address);
        assert.ok(own.includes(hostname), `${hostname} is none of ${own}`);
        for (const found of own.filter((ip) => !ip.includes(':'))) {
            assert.equal((await get(`http://${found}:${port}/`)).status, 200, found);
        }
        if (hostname !== '127.0.0.1') {
            assert.equal(decodeQr(lines), address);
            // A server without the option is not reachable there.
            const closed = local.address.replace('127.0.0.1', hostname);
            await assert.rejects(get(closed), /ECONNREFUSED/);
        }
        assert.equal(local.output.trim(), local.address);
    } finally {
        await Promise.all([shared.end(), local.end()]);
    }
});

test('on a page that other devices can reach, the menu shows the link as a QR code', async () => {
    const server = await serveFolder(PAGE);
    const at = server.address.replace('127.0.0.1', ELSEWHERE);
    try {
        const lab = await open('scene=pendulum&c=0.5mm&play=0', { at, backend: 'webgl' });
        await lab.click('Button', 'Save');
        await lab.click('Button', 'QR code');
        // The dialog takes its place in the middle once it knows the size of the code.
        await lab.frame(4);
        const { rect: [x0, y0, x1, y1] } = await lab.find('Image', 'QR code of the link');
        await lab.draw();
        const picture = await lab.pixels({ x: Math.round(x0), y: Math.round(y0), width: Math.round(x1 - x0), height: Math.round(y1 - y0) });
        const link = jsQR(new Uint8ClampedArray(picture.data), picture.width, picture.height)?.data;
        assert.equal(link, `${at}#${await lab.page.evaluate(() => globalThis.jointplay.page.link())}`);
        await lab.close();
    } finally {
        await server.end();
    }
});

test('the licences open from the page before it has started, and from About', async () => {
    const lab = await open('scene=pendulum&play=0', { backend: 'webgl', size: { width: 1000, height: 480 } });
    const licences = async (click) => {
        const [opened] = await Promise.all([lab.context.waitForEvent('page'), click()]);
        await opened.waitForLoadState();
        assert.match(await opened.textContent('body'), /epaint_default_fonts[^]*SIL Open Font License/);
        await opened.close();
    };
    await licences(() => lab.page.locator('[rel=license]').evaluate((link) => link.click()));
    await lab.click('Button', 'About');
    await licences(() => lab.click('Link', 'Licences of the fonts and libraries'));
    await lab.close();
});

/** Turns `folder` into another build: with a mark, and a worker that throws in a page of the first build. */
function makeSecondBuild(folder) {
    const write = (name, change) => {
        const file = path.join(folder, name);
        const text = change(fs.readFileSync(file, 'utf8'));
        fs.writeFileSync(file, text);
        for (const ending of ['br', 'gz']) fs.rmSync(`${file}.${ending}`, { force: true });
        return `sha256-${createHash('sha256').update(text).digest('base64')}`;
    };
    const [, old] = /main\.js\?([0-9a-f]+)/.exec(fs.readFileSync(path.join(folder, 'index.html'), 'utf8'));
    const rename = (text) => text.replaceAll(old, `${old.slice(1)}0`);
    const sums = {
        'index.html': write('index.html', rename),
        'main.js': write('main.js', (text) => `globalThis.secondBuild = true;\n${text}`),
        'worker.js': write('worker.js', (text) => `if (!location.search.endsWith('0')) throw new Error('the worker of another build');\n${text}`),
    };
    write('offline.js', (text) => Object.entries(sums).reduce(
        (text, [name, sum]) => text.replace(new RegExp(`('${name}': )'[^']*'`), `$1'${sum}'`),
        rename(text),
    ));
}

test('the page works without a network, and a newer build replaces it completely', async () => {
    const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'jointplay-page-'));
    fs.cpSync(PAGE, folder, { recursive: true });
    let server = await serveFolder(folder);
    const { address } = server;
    const { port } = new URL(address);
    const ofThisPage = (names) => names.filter((name) => name.startsWith('jointplay '));
    const storedBuilds = async (lab) => ofThisPage(await lab.page.evaluate(() => caches.keys()));
    const isSecond = (lab) => lab.page.evaluate(() => Boolean(globalThis.secondBuild));
    // Another page of the same origin has stored something at the addresses of this one.
    const plant = async () => {
        const cache = await caches.open('another page');
        const [build] = /\?[0-9a-f]{16}/.exec(await (await fetch('./')).text());
        for (const name of ['./', `main.js${build}`]) await cache.put(name, new Response('globalThis.planted = true'));
    };
    const before = `if (location.search) globalThis.planting = (${plant})().catch(() => {})`;
    const context = { serviceWorkers: 'allow' };
    const first = await open('scene=spcmm&spcmm.frequency=50Hz&play=0', { at: address, backend: 'webgl', context, before: [{ content: before }] });
    try {
        await first.page.evaluate(() => globalThis.planting);
        await first.until(() => first.page.evaluate(() => Boolean(navigator.serviceWorker.controller)), 'nothing is stored');
        assert.equal((await storedBuilds(first)).length, 1);

        await server.end();
        await first.page.reload();
        await first.started();
        assert.equal(await first.page.evaluate(() => globalThis.jointplay.trouble), null);
        await first.runTo(0.01);
        assert.ok((await first.state()).steps > 0);
        const licences = await first.context.newPage();
        await licences.goto(`${address}licences.txt`);
        assert.match(await licences.textContent('body'), /UBUNTU FONT LICENCE/);
        await assert.rejects(licences.goto(`${address}another/page`), /ERR_/);
        await licences.close();

        makeSecondBuild(folder);
        server = await serveFolder(folder, port);
        // The open page continues with its own files; the newer worker would throw.
        await first.page.evaluate(async () => (await navigator.serviceWorker.getRegistration()).update());
        await first.key('b');
        await first.activate('button', 'Start sweep');
        await first.until(async () => (await first.widgets()).some(({ label }) => /^[1-9]\d* of \d+ values/.test(label)), 'no worker');
        assert.equal(await isSecond(first), false);
        await first.until(async () => (await storedBuilds(first)).length === 2, 'the newer build is not stored');

        // A second tab gets the newer build, which alone remains once the first tab is closed.
        const second = await first.context.newPage();
        await second.addInitScript(drawNothing);
        const goto = async () => {
            await second.goto(`${address}?scene=pendulum&play=0&renderer=webgl`);
            await second.waitForFunction(() => globalThis.jointplay?.ready);
            assert.equal(await second.evaluate(() => globalThis.secondBuild), true);
        };
        await goto();
        await first.page.close();
        // The browser notices closed pages late; a page opened meanwhile, here a single file, keeps the older service worker.
        let remaining;
        for (let attempt = 0; attempt < 300 && remaining !== 1; attempt += 1) {
            await second.goto('about:blank');
            await new Promise((done) => setTimeout(done, 10));
            await second.goto(`${address}icon.svg`);
            remaining = ofThisPage(await second.evaluate(() => caches.keys())).length;
        }
        assert.equal(remaining, 1, 'the older build stays');
        await server.end();
        await goto();
    } finally {
        await first.close({ errors: true });
        await server.end();
        fs.rmSync(folder, { recursive: true });
    }
});
