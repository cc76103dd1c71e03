// The pictures on the buttons: strokes in a square of 20.

const ICONS = {
	fit: 'M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4M7.5 8.5 10 7l2.5 1.5v3L10 13l-2.5-1.5z',
	top: 'M10 3 17 6.5 10 10 3 6.5zM3 6.5v7L10 17l7-3.5v-7M6 6.5l4-2 4 2-4 2z',
	front: 'M10 3 17 6.5 10 10 3 6.5zM3 6.5v7L10 17v-7M10 17l7-3.5v-7M5 9.5v3.5l3 1.5V11z',
	right: 'M10 3 17 6.5 10 10 3 6.5zM3 6.5v7L10 17v-7M10 17l7-3.5v-7M15 9.5v3.5l-3 1.5V11z',
	oblique: 'M10 3 17 6.5 10 10 3 6.5zM3 6.5v7L10 17v-7M10 17l7-3.5v-7',
	parallel: 'M4 4v12M16 4v12M4 7h12M4 13h12',
	fly: 'M3 10.5 17 3l-3.5 14-4-5zM9.5 12 17 3',
	measure: 'M3 13.5 13.5 3 17 6.5 6.5 17zM6 10.5l1.7 1.7M8.5 8l2.4 2.4M11 5.5l1.7 1.7',
	link: 'M8.5 11.5a3 3 0 0 0 4.2 0l3-3a3 3 0 0 0-4.2-4.2l-1 1M11.5 8.5a3 3 0 0 0-4.2 0l-3 3a3 3 0 0 0 4.2 4.2l1-1',
	theme: 'M10 3a7 7 0 1 0 0 14zM10 3a7 7 0 0 1 0 14',
	help: 'M10 17a7 7 0 1 0 0-14 7 7 0 0 0 0 14zM7.8 8a2.2 2.2 0 1 1 3.2 2c-.7.4-1 .8-1 1.6M10 13.8v.2',
};

/** The picture of a name. */
export function icon( name ) {

	const svg = document.createElementNS( 'http://www.w3.org/2000/svg', 'svg' );
	svg.setAttribute( 'viewBox', '0 0 20 20' );
	const path = document.createElementNS( 'http://www.w3.org/2000/svg', 'path' );
	path.setAttribute( 'd', ICONS[ name ] );
	svg.append( path );
	return svg;

}
