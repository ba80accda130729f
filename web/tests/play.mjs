// What a browser shows of a film.

import { PNG } from 'pngjs';

/** Loads a film into an empty page of a browser: its size and length, and its picture at each of `times`, s. */
export async function play({ page }, bytes, times) {
    const film = `data:video/mp4;base64,${bytes.toString('base64')}`;
    const shown = await page.evaluate(async ([film, times]) => {
        const video = document.createElement('video');
        const heard = (event) => new Promise((done, failed) => {
            video.addEventListener(event, done, { once: true });
            video.addEventListener('error', () => failed(new Error(video.error.message)), { once: true });
        });
        const ready = heard('loadeddata');
        Object.assign(video, { muted: true, preload: 'auto', src: film });
        await ready;
        const { videoWidth: width, videoHeight: height, duration } = video;
        const canvas = Object.assign(document.createElement('canvas'), { width, height });
        const context = canvas.getContext('2d', { willReadFrequently: true });
        const pictures = [];
        for (const time of times) {
            const there = heard('seeked');
            video.currentTime = time;
            await there;
            // Some time after the seek the frame is decoded; until then nothing is drawn.
            for (let looks = 0; looks < 1000; looks += 1) {
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
