// Plays films in a browser.

import { PNG } from 'pngjs';

/** Loads a film into an empty page: returns its size and duration, and its picture at each of `times`, s. */
export async function play({ page }, bytes, times) {
    const film = `data:video/mp4;base64,${bytes.toString('base64')}`;
    const shown = await page.evaluate(async ([film, times]) => {
        const video = document.createElement('video');
        const fired = (event) => new Promise((done, failed) => {
            video.addEventListener(event, done, { once: true });
            video.addEventListener('error', () => failed(new Error(video.error.message)), { once: true });
        });
        const ready = fired('loadeddata');
        Object.assign(video, { muted: true, preload: 'auto', src: film });
        await ready;
        const { videoWidth: width, videoHeight: height, duration } = video;
        const canvas = Object.assign(document.createElement('canvas'), { width, height });
        const context = canvas.getContext('2d', { willReadFrequently: true });
        const pictures = [];
        for (const time of times) {
            const seeked = fired('seeked');
            video.currentTime = time;
            await seeked;
            // The frame is decoded some time after the seek; until then nothing is drawn.
            for (let attempts = 0; attempts < 1000; attempts += 1) {
                context.drawImage(video, 0, 0);
                if (context.getImageData(width >> 1, height >> 1, 1, 1).data[3] > 0) break;
                await new Promise((done) => setTimeout(done, 10));
            }
            pictures.push(canvas.toDataURL('image/png'));
        }
        return { width, height, duration, pictures };
    }, [film, times]);
    const decode = (url) => PNG.sync.read(Buffer.from(url.split(',')[1], 'base64'));
    return { ...shown, pictures: shown.pictures.map(decode) };
}
