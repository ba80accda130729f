// Says so where the program of the page does not come: the one script that any browser takes, from a file as well.

function stuck() {
    document.getElementById('stuck').hidden = false;
}

// A script that cannot be loaded tells nobody but itself, and who listens on the way down to it.
addEventListener('error', function (event) {
    if (event.target.id === 'program') stuck();
}, true);

// Too old for modules: it leaves the program out and says nothing.
if (!('noModule' in HTMLScriptElement.prototype)) addEventListener('load', stuck);
